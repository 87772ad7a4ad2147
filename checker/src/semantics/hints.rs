//! What is probably meant by a name that stands where it cannot, for the hints of diagnostics.

use super::checker::Checker;
use super::codes;
use super::groups::Group;
use super::scope::Entity;
use crate::diagnostics::Span;

/// At most this many names are listed in a hint.
const MOST_LISTED: usize = 6;

/// Types and values as other languages name them, each with that of UPPAAL.
const FOREIGN_NAMES: [(&str, &str); 10] = [
    ("boolean", "bool"),
    ("integer", "int"),
    ("float", "double"),
    ("real", "double"),
    ("channel", "chan"),
    ("timer", "clock"),
    ("True", "true"),
    ("TRUE", "true"),
    ("False", "false"),
    ("FALSE", "false"),
];

impl Checker<'_> {
    /// Reports an unknown name, and says what is probably meant.
    pub(super) fn unknown_name(&mut self, name: &str, span: Span) {
        if name == "cost" {
            // Priced models use the name without a declaration.
            self.error(
                codes::CONSTRUCT_UNSUPPORTED,
                span,
                "not supported: the variable `cost` of priced models (CORA)",
                "declare an integer or a clock of this name, or remove what uses it",
            );
            return;
        }
        let help = self.instead_of_unknown(name);
        self.error(
            codes::NAME_UNKNOWN,
            span,
            format!("'{name}' is not declared"),
            &help,
        );
    }

    fn instead_of_unknown(&self, name: &str) -> String {
        if self.hides_system && self.scopes.iter().any(|scope| scope.get(name).is_some()) {
            return String::from(
                "declare it in the global declarations: templates do not see the system section",
            );
        }
        if self.is_query
            && let Some(process) = self.process_with(name)
        {
            return format!("write `{process}.{name}`: it belongs to the process");
        }
        if let Some((_, meant)) = FOREIGN_NAMES.iter().find(|one| one.0 == name) {
            return format!("write `{meant}`");
        }
        if self.is_query && matches!(name, "time" | "now" | "t") {
            return String::from("declare a clock that is never reset, or bound runs by `[<=10]`");
        }
        match self.similar_name(name) {
            Some(similar) => similar_hint(name, &similar),
            None => String::from("declare it first"),
        }
    }

    /// The name of the first process that declares this name, as queries write it.
    fn process_with(&self, name: &str) -> Option<String> {
        let declares = |group: &Group| {
            let scope = self.world.processes.scopes.get(group.first as usize);
            scope.is_some_and(|scope| scope.get(name).is_some())
        };
        self.first_group(declares)
    }

    /// The first process that comes from this template, as queries write it.
    pub(super) fn process_of_template(&self, template: &str) -> Option<String> {
        let processes = &self.world.network.processes;
        self.first_group(|group| {
            processes
                .get(group.first as usize)
                .is_some_and(|process| process.template == template)
        })
    }

    /// How queries write the first member of the first group that is wanted.
    fn first_group(&self, is_wanted: impl Fn(&Group) -> bool) -> Option<String> {
        let groups = self.world.processes.groups.iter();
        let (name, group) = groups
            .filter(|(_, group)| is_wanted(group))
            .min_by_key(|(_, group)| group.first)?;
        Some(first_member(name, group))
    }

    /// What to write instead of a name that stands for no value.
    pub(super) fn instead_of_value(&self, name: &str, entity: &Entity) -> String {
        let group = self.world.processes.groups.get(name);
        match (entity, group) {
            (Entity::Template(_) | Entity::Instantiation(_), Some(group)) if self.is_query => {
                let scope = self.world.processes.scopes.get(group.first as usize);
                let location = scope.and_then(|scope| scope.locations().first().copied());
                let process = first_member(name, group);
                format!(
                    "name a location or a variable of the process: {process}.{}",
                    location.unwrap_or("x")
                )
            }
            (Entity::Location(_), _) => String::from(
                "only queries can ask for locations; in the model, keep what you need in a variable",
            ),
            _ => String::from("use a variable, a constant or a call"),
        }
    }

    /// What to write instead of a location or variable that a process does not have.
    pub(super) fn instead_of_member(&self, process: u32, name: &str) -> String {
        let scope = &self.world.processes.scopes[process as usize];
        if let Some((_, similar)) = scope.similar(name) {
            return similar_hint(name, similar);
        }
        let locations = scope.locations();
        if locations.is_empty() {
            return String::from("name a variable of the process");
        }
        let shown = locations.iter().take(MOST_LISTED).copied();
        let shown = shown.collect::<Vec<_>>().join(", ");
        let rest = if locations.len() > MOST_LISTED {
            ", …"
        } else {
            ""
        };
        format!("name a variable of the process or one of its locations: {shown}{rest}")
    }
}

/// The first process of a group, as queries write it.
pub(super) fn first_member(name: &str, group: &Group) -> String {
    if group.parameters.is_empty() {
        return name.to_owned();
    }
    let first: Vec<String> = group
        .parameters
        .iter()
        .map(|parameter| parameter.bounds().0.to_string())
        .collect();
    format!("{name}({})", first.join(", "))
}

fn similar_hint(name: &str, similar: &str) -> String {
    if similar.eq_ignore_ascii_case(name) {
        format!("did you mean '{similar}'? Small and capital letters differ")
    } else if similar.len() == name.len() && differs_by_look_alikes(name, similar) {
        format!("did you mean '{similar}'? The letters l, I, O and the digits 1, 0 look alike")
    } else {
        format!("did you mean '{similar}'?")
    }
}

fn differs_by_look_alikes(left: &str, right: &str) -> bool {
    let mut pairs = left.chars().zip(right.chars());
    pairs.all(|(a, b)| super::scope::looks_like(a) == super::scope::looks_like(b))
}

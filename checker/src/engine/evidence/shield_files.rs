//! Shields and their files, read for this model.
//!
//! The axes of a file are texts, which are compiled in the stochastic reading, as those of a query
//! are. They hold as long as the analysis of the model that they were compiled in.

use std::sync::Arc;

use serde_json::Value as Json;

use crate::diagnostics::Span;
use crate::engine::format::json_reader::Mismatch;
use crate::engine::format::learned_code::Language;
use crate::engine::format::{shield_code, shield_json};
use crate::engine::loaded_model::LoadedModel;
use crate::engine::options::Options;
use crate::engine::rejection::Rejection;
use crate::ir::{Axis, Feature, Part};
use crate::semantics::Reading;
use crate::shield::{Grid, Shield};

const SEE_NAMES: &str = "the names of the axes must have a meaning in this model";

/// What the file of a shield is about.
pub(super) struct ShieldMeaning {
    features: Vec<Feature>,
    moves: Vec<Part>,
}

impl LoadedModel {
    /// A shield as the text of a file.
    pub fn shield_text(&self, shield: &Shield, query: &str) -> String {
        shield_json::text(self.network_of_runs(), shield, query)
    }

    /// A shield as a function in another language, whose names begin so.
    pub fn shield_code(
        &self,
        shield: &Shield,
        language: Language,
        name: &str,
        query: &str,
    ) -> String {
        shield_code::write(self.network_of_runs(), shield, language, name, query)
    }

    /// What the file of a shield is about in this model.
    pub(super) fn shield_meaning(
        &mut self,
        file: &Json,
        span: Span,
        options: &Options,
    ) -> Result<Result<ShieldMeaning, Mismatch>, Rejection> {
        let names = match shield_json::names(file) {
            Ok(names) => names,
            Err(mismatch) => return Ok(Err(mismatch)),
        };
        self.expect_stochastic()?;
        let features = match self.axes_of(&names) {
            Ok(features) => features,
            Err(mismatch) => return Ok(Err(mismatch)),
        };
        self.prepare_code(Reading::Stochastic, options.code, options.tuning, span)?;
        let moves = self.moves_of_controller();
        Ok(Ok(ShieldMeaning {
            features,
            moves: moves.iter().map(|one| one.part).collect(),
        }))
    }

    /// What the names of axes are in this model.
    fn axes_of(&mut self, names: &[String]) -> Result<Vec<Feature>, Mismatch> {
        let features = names.iter().enumerate().map(|(index, text)| {
            self.feature_of(text, false).map_err(|why| Mismatch {
                place: format!("axes[{index}].name"),
                message: format!("{text} is nothing that a state has: {why}"),
                help: Some(SEE_NAMES),
            })
        });
        features.collect()
    }

    /// Reads the file of a shield.
    pub(super) fn read_shield(
        &self,
        file: &Json,
        meaning: &ShieldMeaning,
    ) -> Result<Shield, Mismatch> {
        let names = shield_json::Names {
            network: self.network_of_runs(),
            features: &meaning.features,
            moves: &meaning.moves,
        };
        shield_json::read(file, &names)
    }

    /// Finds again where the axes of a shield are, where the model is analysed anew.
    pub(super) fn renewed(&mut self, shield: &Shield) -> Option<Arc<Shield>> {
        let axes = &shield.grid.axes;
        let names: Vec<String> = axes.iter().map(|one| one.feature.text.clone()).collect();
        let features = self.axes_of(&names).ok()?;
        let axes = axes.iter().zip(features).map(|(axis, feature)| Axis {
            feature,
            ..axis.clone()
        });
        Some(Arc::new(Shield {
            grid: Grid {
                axes: axes.collect(),
            },
            ..shield.clone()
        }))
    }
}

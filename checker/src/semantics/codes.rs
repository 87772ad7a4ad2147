//! The mistakes that this layer reports: `E02…` and `W02…`, each named by the defect.

use crate::diagnostics::codes;

codes! {
    /// A name that nothing declares.
    NAME_UNKNOWN = "E0201" "name-unknown";
    /// Two declarations of one name in one scope.
    NAME_DECLARED_TWICE = "E0202" "name-declared-twice";
    /// A type, function, template or location where a value is needed.
    NAME_WITHOUT_VALUE = "E0203" "name-without-value";
    /// A name that is not a type where a type is needed.
    TYPE_EXPECTED = "E0204" "type-expected";
    /// A type that cannot stand where it stands.
    TYPE_MISPLACED = "E0205" "type-misplaced";
    /// `const`, `meta`, `urgent`, `broadcast` or `hybrid` on a type that does not take it.
    PREFIX_MISPLACED = "E0206" "prefix-misplaced";
    /// A range whose lower bound is greater than its upper bound.
    RANGE_EMPTY = "E0207" "range-empty";
    /// A type without bounds where something runs over its values.
    RANGE_EXPECTED = "E0208" "range-expected";
    /// More values than can be run through.
    RANGE_TOO_LARGE = "E0209" "range-too-large";
    /// A negative size; a scalar set, or an array of clocks or channels, without parts.
    SIZE_NOT_POSITIVE = "E0210" "size-not-positive";
    /// An array size or `select` range that depends on a free parameter of a process set.
    SIZE_HANGS_ON_FREE_PARAMETER = "E0211" "size-hangs-on-free-parameter";
    /// An array with too many parts.
    ARRAY_TOO_LARGE = "E0212" "array-too-large";
    /// A value that depends on the state where it must be known when the model is loaded.
    VALUE_NOT_CONSTANT = "E0213" "value-not-constant";
    /// A constant without a value.
    CONSTANT_NOT_INITIALISED = "E0214" "constant-not-initialised";
    /// A constant outside the range of what it is given to.
    CONSTANT_OUT_OF_RANGE = "E0215" "constant-out-of-range";
    /// A constant expression that ends in an error.
    CONSTANT_WITHOUT_VALUE = "E0216" "constant-without-value";
    /// Too few or too many initial values.
    INITIALISER_COUNT = "E0218" "initialiser-count";
    /// An initial value of a shape that the type does not have.
    INITIALISER_MISMATCHED = "E0219" "initialiser-mismatched";
    /// Something other than an integer where one is needed.
    INTEGER_EXPECTED = "E0220" "integer-expected";
    /// Something other than a number where one is needed.
    NUMBER_EXPECTED = "E0221" "number-expected";
    /// Something other than a condition where one is needed.
    CONDITION_EXPECTED = "E0222" "condition-expected";
    /// Something other than a channel where one is needed.
    CHANNEL_EXPECTED = "E0223" "channel-expected";
    /// A value of another type than the one needed.
    TYPE_MISMATCHED = "E0224" "type-mismatched";
    /// An operator on types that it does not apply to.
    OPERANDS_MISMATCHED = "E0225" "operands-mismatched";
    /// An index of another type than the array's scalar set.
    SCALAR_SET_EXPECTED = "E0226" "scalar-set-expected";
    /// An assignment to something that cannot change.
    TARGET_NOT_ASSIGNABLE = "E0227" "target-not-assignable";
    /// A change where nothing may change.
    SIDE_EFFECT = "E0228" "side-effect";
    /// A field of something that is not a struct.
    FIELD_OF_NO_STRUCT = "E0229" "field-of-no-struct";
    /// A field that the struct does not have.
    FIELD_UNKNOWN = "E0230" "field-unknown";
    /// An index into something that is not an array.
    INDEX_OF_NO_ARRAY = "E0231" "index-of-no-array";
    /// A call of something that is not a function.
    CALL_OF_NO_FUNCTION = "E0232" "call-of-no-function";
    /// Too few or too many arguments.
    ARGUMENT_COUNT = "E0233" "argument-count";
    /// A reference argument of another type than its parameter.
    REFERENCE_MISMATCHED = "E0234" "reference-mismatched";
    /// A reference argument of a template that is not known when the model is loaded.
    REFERENCE_NOT_UNIQUE = "E0235" "reference-not-unique";
    /// A clock or channel passed by value.
    PARAMETER_BY_VALUE = "E0236" "parameter-by-value";
    /// A function that calls itself.
    FUNCTION_RECURSIVE = "E0237" "function-recursive";
    /// A type that functions cannot return.
    RESULT_TYPE = "E0238" "result-type";
    /// A path through a function that returns no value.
    RETURN_MISSING = "E0239" "return-missing";
    /// `return` with a value where none belongs, or without where one does.
    RETURN_MISMATCHED = "E0240" "return-mismatched";
    /// A sum of clocks that is not a difference of two.
    CLOCKS_BEYOND_DIFFERENCE = "E0242" "clocks-beyond-difference";
    /// A clock compared with, or set to, a double.
    CLOCK_WITH_DOUBLE = "E0243" "clock-with-double";
    /// The value of a clock used as a number.
    CLOCK_AS_NUMBER = "E0244" "clock-as-number";
    /// A clock compared with a constant beyond the limit.
    CLOCK_BOUND_TOO_LARGE = "E0245" "clock-bound-too-large";
    /// A clock set to a difference of clocks.
    CLOCK_SET_TO_DIFFERENCE = "E0246" "clock-set-to-difference";
    /// A clock of a query that is chosen by `?:`.
    CLOCK_CHOSEN = "E0247" "clock-chosen";
    /// A condition on a hybrid clock.
    HYBRID_CLOCK_COMPARED = "E0248" "hybrid-clock-compared";
    /// A rate outside an invariant.
    RATE_MISPLACED = "E0249" "rate-misplaced";
    /// The rate of something that is not a known clock.
    RATE_OF_NO_CLOCK = "E0250" "rate-of-no-clock";
    /// A rate other than 0 and 1 on an ordinary clock.
    RATE_NOT_ZERO_OR_ONE = "E0251" "rate-not-zero-or-one";
    /// A condition on clocks that is too general for a guard.
    CONDITION_NOT_A_GUARD = "E0252" "condition-not-a-guard";
    /// A condition on clocks that is too general for an invariant.
    CONDITION_NOT_AN_INVARIANT = "E0253" "condition-not-an-invariant";
    /// An edge or `init` that names no location.
    LOCATION_UNKNOWN = "E0254" "location-unknown";
    /// An initial location that does not exist.
    INITIAL_LOCATION = "E0256" "initial-location";
    /// A name that is not a template where one is needed.
    TEMPLATE_EXPECTED = "E0258" "template-expected";
    /// A process in the system line with a parameter that has no value and no bounds.
    FREE_PARAMETER_UNBOUNDED = "E0259" "free-parameter-unbounded";
    /// A process that stands twice in the system line.
    PROCESS_TWICE = "E0260" "process-twice";
    /// A system whose sets of processes are all empty.
    SYSTEM_EMPTY = "E0261" "system-empty";
    /// A channel with two priorities.
    PRIORITY_TWICE = "E0262" "priority-twice";
    /// A construct that was read and is not supported.
    CONSTRUCT_UNSUPPORTED = "E0263" "construct-unsupported";
    /// A random function, which symbolic queries cannot evaluate.
    RANDOM_UNSUPPORTED = "E0264" "random-unsupported";
    /// A query about a process that is not in the system line.
    PROCESS_NOT_IN_SYSTEM = "E0265" "process-not-in-system";
    /// A location or variable that the process does not have.
    MEMBER_UNKNOWN = "E0266" "member-unknown";
    /// A member of a process set that must be constant.
    MEMBER_NOT_CONSTANT = "E0267" "member-not-constant";
    /// Something that `sup` and `inf` cannot measure.
    MEASURE_EXPECTED = "E0268" "measure-expected";
    /// A double or hybrid clock in a symbolic or game query.
    DOUBLE_IN_QUERY = "E0269" "double-in-query";
    /// `deadlock` outside `E<>` and `A[]`.
    DEADLOCK_MISPLACED = "E0270" "deadlock-misplaced";
    /// `deadlock` on a model for which it cannot be decided.
    DEADLOCK_UNSUPPORTED = "E0271" "deadlock-unsupported";
    /// A game query on a model with a strict invariant.
    GAME_WITH_STRICT_INVARIANT = "E0272" "game-with-strict-invariant";
    /// An observation, or a model, that partial observation cannot handle.
    OBSERVATION_REFUSED = "E0273" "observation-refused";
    /// A kind of query that is not supported.
    QUERY_UNSUPPORTED = "E0274" "query-unsupported";
    /// A strategy that no query defined.
    STRATEGY_UNKNOWN = "E0275" "strategy-unknown";
    /// A strategy that is loaded, or a shield, without a name.
    STRATEGY_WITHOUT_NAME = "E0277" "strategy-without-name";
    /// A function that is called by its name, with parameters or a result.
    HOOK_SIGNATURE = "E0281" "hook-signature";
    /// A function that makes the initial state and ends in an error.
    HOOK_FAILS = "E0282" "hook-fails";
    /// An invariant that gives a clock two rates.
    RATE_TWICE = "E0285" "rate-twice";
    /// A statistical query in which nothing says when a run is over.
    RUN_UNBOUNDED = "E0286" "run-unbounded";
    /// A channel, or a condition on clocks, where a statement is needed.
    NOT_A_STATEMENT = "E0291" "not-a-statement";
    /// A channel that is chosen by `?:`.
    CHANNEL_CHOSEN = "E0292" "channel-chosen";
    /// An imported function with a parameter or result that C does not have.
    EXTERNAL_SIGNATURE = "E0293" "external-signature";
    /// A library that cannot be loaded.
    EXTERNAL_LIBRARY = "E0294" "external-library";
    /// A function that its library does not have.
    EXTERNAL_MISSING = "E0295" "external-missing";
    /// An imported function that something depends on which symbolic queries need.
    EXTERNAL_SYMBOLIC = "E0296" "external-symbolic";
    /// Something that dynamic templates do not allow.
    DYNAMIC_MISUSED = "E0297" "dynamic-misused";
    /// A dynamic template, which symbolic queries do not know.
    DYNAMIC_SYMBOLIC = "E0298" "dynamic-symbolic";
    /// Something that a strategy cannot see.
    FEATURE_EXPECTED = "E0299" "feature-expected";
    /// Something that is no axis of the grid of a shield.
    SHIELD_AXIS = "E0289" "shield-axis";
    /// A branch point that has no leg, or one that does not end in a location.
    BRANCH_POINT_OPEN = "E0287" "branch-point-open";
    /// An edge to a branch point and a leg of it that both synchronise.
    SYNCHRONISES_TWICE = "E0288" "synchronises-twice";
    /// An expression whose value is dropped and that changes nothing.
    EFFECT_MISSING = "W0201" "effect-missing";
    /// An invariant with a strict upper bound.
    INVARIANT_STRICT = "W0202" "invariant-strict";
    /// Fewer initial values than the array has parts.
    INITIALISER_INCOMPLETE = "W0205" "initialiser-incomplete";
    /// A mutable double, which UPPAAL would leave out of the state.
    DOUBLE_IN_STATE = "W0203" "double-in-state";
    /// A strategy that takes the place of an earlier one.
    STRATEGY_TWICE = "W0204" "strategy-twice";
    /// A hybrid clock, which symbolic and game queries do not see.
    HYBRID_CLOCK_IGNORED = "W0206" "hybrid-clock-ignored";
    /// An array without parts.
    ARRAY_EMPTY = "W0207" "array-empty";
    /// Arithmetic of constants beyond 32 bits.
    CONSTANT_WRAPS = "W0212" "constant-wraps";
    /// A double that takes values of clocks or random numbers, which symbolic and game queries do
    /// not see.
    DOUBLE_IGNORED = "W0213" "double-ignored";
    /// A clock with rates or values of its own, which symbolic and game queries do not see.
    CLOCK_IGNORED = "W0214" "clock-ignored";
    /// Something unsupported that no process of the system uses.
    UNSUPPORTED_UNUSED = "W0215" "unsupported-unused";
    /// A live sequence chart, which does not change the system.
    CHART_IGNORED = "W0216" "chart-ignored";
    /// A model that only statistical queries can be asked of.
    STATISTICAL_ONLY = "W0217" "statistical-only";
    /// `a <= b <= c`, which compares a truth value.
    COMPARISON_CHAINED = "W0218" "comparison-chained";
    /// A feature of which exact values are compared, and which is a double or a clock.
    FEATURE_EXACT = "W0219" "feature-exact";
    /// A best strategy of a controller without edges.
    NOTHING_TO_CHOOSE = "W0220" "nothing-to-choose";
    /// A function that UPPAAL calls after all that a query sees.
    HOOK_WITHOUT_EFFECT = "W0211" "hook-without-effect";
}

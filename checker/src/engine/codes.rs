//! Codes of what the engine refuses to answer although the model is right.

crate::diagnostics::codes! {
    /// A kind of query that the engine has no algorithm for.
    UNSUPPORTED_QUERY = "E0801" "unsupported-query";
    /// A construct of the model that the engine has no algorithm for.
    UNSUPPORTED_CONSTRUCT = "E0802" "unsupported-construct";
    /// Compiled code was asked for, and this build or machine has none.
    NO_COMPILED_CODE = "E0803" "no-compiled-code";
    /// A strategy is asked for whose query was not satisfied.
    NO_STRATEGY = "E0804" "no-strategy";
    /// A file of a strategy that cannot be read or written, or does not fit the model.
    STRATEGY_FILE = "E0805" "strategy-file";
    /// A random run that has no result.
    RUN_FAILS = "E0806" "run-fails";
    /// A shield whose grid has too many cells.
    GRID_TOO_LARGE = "E0807" "grid-too-large";
    /// A shield whose grid a run leaves.
    GRID_LEFT = "E0808" "grid-left";
}

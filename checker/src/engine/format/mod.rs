//! Text, JSON, C and Python: how answers, models and strategies are written and read.

pub mod decision_table;
pub mod decisions;
pub mod distribution_json;
pub mod explain;
pub mod json;
pub mod json_reader;
pub mod learned_actions;
pub mod learned_code;
pub mod learned_json;
pub mod machine_c;
pub mod machine_json;
pub mod model_json;
pub mod network_json;
pub mod shield_code;
pub mod shield_json;
pub mod strategy_c;
pub mod strategy_json;
pub mod strategy_text;
pub mod survey_json;
pub mod text;
pub mod trajectory_json;

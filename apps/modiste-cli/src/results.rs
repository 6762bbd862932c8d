//! Results as JSON and in words.

use modiste::Outcome;

use crate::commands::{bench, body, check, crowd, dress, garment, hair};

/// What a script reads at the end: the outcome under its name; of a benchmark the rows alone.
pub(crate) fn json(outcome: &Outcome) -> serde_json::Result<String> {
    match outcome {
        Outcome::BenchedDress(benched) => serde_json::to_string_pretty(&benched.rows),
        Outcome::BenchedHair(benched) => serde_json::to_string_pretty(&benched.rows),
        outcome => serde_json::to_string_pretty(outcome),
    }
}

/// What a person reads at the end.
pub(crate) fn text(outcome: &Outcome) -> String {
    match outcome {
        Outcome::Dressed(dressed) => dress::text(dressed),
        Outcome::BenchedDress(benched) => bench::dress::text(benched),
        Outcome::Checked(checked) => check::text(checked),
        Outcome::MadeCrowd(made) => crowd::text(made),
        Outcome::BenchedHair(benched) => bench::hair::text(benched),
        Outcome::LearnedHair(learned) => hair::learn::text(learned),
        Outcome::MadeBody(made) => body::make::text(made),
        Outcome::MeasuredBody(measured) => body::measure::text(measured),
        Outcome::MadePopulation(made) => body::population::text(made),
        Outcome::TrainedBody(trained) => body::train::text(trained),
        Outcome::SimulatedGarment(made) => garment::simulate::text(made),
        Outcome::LearnedGarment(learned) | Outcome::ImportedGarment(learned) => garment::learn::text(learned),
        Outcome::EvaluatedGarment(evaluated) => garment::evaluate::text(evaluated),
        Outcome::TrainedGarment(trained) => garment::train::text(trained),
    }
}

//! The parameters of the artist-made body and how they weigh its targets.

use crate::Gender;

/// What a parameter drives.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ParameterKind {
    /// One of the few parameters whose products weigh whole-body targets; in [0, 1], 0.5 is average.
    Macro,
    /// Share of one of three ancestries; not negative, and only the ratio of the three matters.
    Ancestry,
    /// One local detail; in [-1, 1], 0 leaves the body as it is.
    Detail,
}

/// One parameter of a [`super::MakeHumanModel`].
#[derive(Debug, Clone, PartialEq)]
pub struct Parameter {
    /// Name, for example `weight` or `torso/measure-waist-circ`.
    pub name: String,
    /// What it drives.
    pub kind: ParameterKind,
    /// Smallest value.
    pub lowest: f64,
    /// Largest value.
    pub highest: f64,
    /// Value of the average young adult.
    pub default: f64,
}

impl Parameter {
    fn new(name: &str, kind: ParameterKind, range: [f64; 2], default: f64) -> Self {
        Self { name: name.to_owned(), kind, lowest: range[0], highest: range[1], default }
    }
}

/// A factor of a macro target's weight: piecewise linear in one parameter with knots at 0, 1/2 and 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Factor {
    /// Value at the three knots.
    Knots { parameter: usize, values: [f64; 3] },
    /// This ancestry's share of the three.
    Share { parameter: usize, all: [usize; 3] },
    /// The positive (`1`) or negative (`-1`) part of a detail.
    Part { parameter: usize, sign: f64 },
}

impl Factor {
    pub(super) fn parameters(self) -> [Option<usize>; 3] {
        match self {
            Self::Knots { parameter, .. } | Self::Part { parameter, .. } => [Some(parameter), None, None],
            Self::Share { all, .. } => all.map(Some),
        }
    }

    pub(super) fn value(self, values: &[f64]) -> f64 {
        match self {
            Self::Knots { parameter, values: [low, middle, high] } => {
                let t = values[parameter];
                if t < 0.5 { low + 2.0 * t * (middle - low) } else { middle + (2.0 * t - 1.0) * (high - middle) }
            }
            Self::Share { parameter, all } => {
                let total: f64 = all.iter().map(|&index| values[index]).sum();
                if total > 0.0 { values[parameter] / total } else { 1.0 / 3.0 }
            }
            Self::Part { parameter, sign } => (sign * values[parameter]).max(0.0),
        }
    }

    /// Derivative by `parameter`; at a knot that of the piece above.
    pub(super) fn derivative(self, values: &[f64], by: usize) -> f64 {
        match self {
            Self::Knots { parameter, values: [low, middle, high] } if parameter == by => {
                if values[parameter] < 0.5 {
                    2.0 * (middle - low)
                } else {
                    2.0 * (high - middle)
                }
            }
            Self::Share { parameter, all } if all.contains(&by) => {
                let total: f64 = all.iter().map(|&index| values[index]).sum();
                let own = if parameter == by { 1.0 } else { 0.0 };
                if total > 0.0 { (own - values[parameter] / total) / total } else { 0.0 }
            }
            Self::Part { parameter, sign } if parameter == by => {
                let rising = sign * values[parameter] > 0.0 || (values[parameter] == 0.0 && sign > 0.0);
                if rising { sign } else { 0.0 }
            }
            _ => 0.0,
        }
    }
}

/// Names of the macro parameters, in order, before the ancestries and details.
const MACROS: [&str; 5] = ["age", "muscle", "weight", "height", "proportions"];
const ANCESTRIES: [&str; 3] = ["african", "asian", "caucasian"];
/// Macro parameters of women alone.
const BREAST_MACROS: [&str; 2] = ["cup_size", "firmness"];

/// Target weights of all macro targets of one gender, and the details: `(target names, factors)` per target.
pub(super) struct ParameterTable {
    pub(super) parameters: Vec<Parameter>,
    pub(super) terms: Vec<(Vec<String>, Vec<Factor>)>,
}

/// A detail: both sides of the body, and the endings of its two targets.
type Detail = (&'static str, bool, [&'static str; 2]);

const DECR_INCR: [&str; 2] = ["decr", "incr"];

/// The details that are used: folder and stem, whether it exists per side, and the endings of the two directions.
/// The face is left alone.
const DETAILS: [Detail; 50] = [
    ("arms/{}-lowerarm-fat", true, DECR_INCR),
    ("arms/{}-lowerarm-muscle", true, DECR_INCR),
    ("arms/{}-lowerarm-scale-depth", true, DECR_INCR),
    ("arms/{}-lowerarm-scale-horiz", true, DECR_INCR),
    ("arms/{}-lowerarm-scale-vert", true, DECR_INCR),
    ("arms/{}-upperarm-fat", true, DECR_INCR),
    ("arms/{}-upperarm-muscle", true, DECR_INCR),
    ("arms/{}-upperarm-scale-depth", true, DECR_INCR),
    ("arms/{}-upperarm-scale-horiz", true, DECR_INCR),
    ("arms/{}-upperarm-scale-vert", true, DECR_INCR),
    ("arms/{}-upperarm-shoulder-muscle", true, DECR_INCR),
    ("arms/measure-lowerarm-length", false, DECR_INCR),
    ("arms/measure-upperarm-length", false, DECR_INCR),
    ("arms/measure-upperarm-circ", false, DECR_INCR),
    ("buttocks/buttocks-volume", false, DECR_INCR),
    ("head/head-scale-depth", false, DECR_INCR),
    ("head/head-scale-horiz", false, DECR_INCR),
    ("head/head-scale-vert", false, DECR_INCR),
    ("hip/hip-scale-depth", false, DECR_INCR),
    ("hip/hip-scale-horiz", false, DECR_INCR),
    ("hip/hip-scale-vert", false, DECR_INCR),
    ("hip/hip-trans", false, ["backward", "forward"]),
    ("hip/hip-waist", false, ["down", "up"]),
    ("legs/{}-lowerleg-fat", true, DECR_INCR),
    ("legs/{}-lowerleg-muscle", true, DECR_INCR),
    ("legs/{}-lowerleg-scale-depth", true, DECR_INCR),
    ("legs/{}-lowerleg-scale-horiz", true, DECR_INCR),
    ("legs/{}-upperleg-fat", true, DECR_INCR),
    ("legs/{}-upperleg-muscle", true, DECR_INCR),
    ("legs/{}-upperleg-scale-depth", true, DECR_INCR),
    ("legs/{}-upperleg-scale-horiz", true, DECR_INCR),
    ("legs/lowerlegs-height", false, DECR_INCR),
    ("legs/upperlegs-height", false, DECR_INCR),
    ("neck/neck-scale-depth", false, DECR_INCR),
    ("neck/neck-scale-horiz", false, DECR_INCR),
    ("neck/neck-scale-vert", false, DECR_INCR),
    ("stomach/stomach-tone", false, DECR_INCR),
    ("stomach/stomach-pregnant", false, DECR_INCR),
    ("stomach/stomach-navel", false, ["down", "up"]),
    ("torso/measure-bust-circ", false, DECR_INCR),
    ("torso/measure-underbust-circ", false, DECR_INCR),
    ("torso/measure-waist-circ", false, DECR_INCR),
    ("torso/measure-hips-circ", false, DECR_INCR),
    ("torso/measure-shoulder-dist", false, DECR_INCR),
    ("torso/torso-scale-depth", false, DECR_INCR),
    ("torso/torso-scale-horiz", false, DECR_INCR),
    ("torso/torso-scale-vert", false, DECR_INCR),
    ("torso/torso-muscle-dorsi", false, DECR_INCR),
    ("torso/torso-muscle-pectoral", false, DECR_INCR),
    ("torso/torso-vshape", false, DECR_INCR),
];

impl ParameterTable {
    /// Parameters and target weights of one gender. Age is used from young (0.5, 25 years) to old (1, 90 years).
    pub(super) fn new(gender: Gender) -> Self {
        let mut parameters: Vec<Parameter> = MACROS
            .iter()
            .map(|&name| {
                let lowest = if name == "age" { 0.5 } else { 0.0 };
                Parameter::new(name, ParameterKind::Macro, [lowest, 1.0], 0.5)
            })
            .collect();
        if gender == Gender::Female {
            parameters
                .extend(BREAST_MACROS.iter().map(|name| Parameter::new(name, ParameterKind::Macro, [0.0, 1.0], 0.5)));
        }
        let first_ancestry = parameters.len();
        parameters
            .extend(ANCESTRIES.iter().map(|name| Parameter::new(name, ParameterKind::Ancestry, [0.0, 1.0], 1.0 / 3.0)));
        let mut table = Self { parameters, terms: Vec::new() };
        table.add_macro_terms(gender, first_ancestry);
        table.add_detail_terms();
        table
    }

    fn index(&self, name: &str) -> usize {
        // Only called with names that `new` has just put in.
        self.parameters.iter().position(|parameter| parameter.name == name).unwrap_or(usize::MAX)
    }

    fn knots(&self, parameter: &str, values: [f64; 3]) -> Factor {
        Factor::Knots { parameter: self.index(parameter), values }
    }

    fn levels(&self, parameter: &str, suffix: &str) -> [(String, Factor); 3] {
        [("min", [1.0, 0.0, 0.0]), ("average", [0.0, 1.0, 0.0]), ("max", [0.0, 0.0, 1.0])]
            .map(|(level, values)| (format!("{level}{suffix}"), self.knots(parameter, values)))
    }

    fn add_macro_terms(&mut self, gender: Gender, first_ancestry: usize) {
        let sex = gender.name();
        let ages = [("young", [1.0, 1.0, 0.0]), ("old", [0.0, 0.0, 1.0])];
        let all = [first_ancestry, first_ancestry + 1, first_ancestry + 2];
        let mut terms = Vec::new();
        for (age, values) in ages {
            let age_factor = self.knots("age", values);
            for (ancestry, parameter) in ANCESTRIES.into_iter().zip(all) {
                let share = Factor::Share { parameter, all };
                terms.push((vec![format!("macrodetails/{ancestry}-{sex}-{age}")], vec![age_factor, share]));
            }
            for (muscle, muscle_factor) in self.levels("muscle", "muscle") {
                for (weight, weight_factor) in self.levels("weight", "weight") {
                    let stem = format!("{sex}-{age}-{muscle}-{weight}");
                    let build = [age_factor, muscle_factor, weight_factor];
                    let mut add = |name: String, more: &[Factor]| {
                        terms.push((vec![name], build.iter().chain(more).copied().collect()));
                    };
                    add(format!("macrodetails/universal-{stem}"), &[]);
                    for (end, values) in [("minheight", [1.0, 0.0, 0.0]), ("maxheight", [0.0, 0.0, 1.0])] {
                        add(format!("macrodetails/height/{stem}-{end}"), &[self.knots("height", values)]);
                    }
                    let proportions = [("uncommonproportions", [1.0, 0.0, 0.0]), ("idealproportions", [0.0, 0.0, 1.0])];
                    for (end, values) in proportions {
                        add(format!("macrodetails/proportions/{stem}-{end}"), &[self.knots("proportions", values)]);
                    }
                    if gender == Gender::Female {
                        for (cup, cup_factor) in self.levels("cup_size", "cup") {
                            for (firmness, firmness_factor) in self.levels("firmness", "firmness") {
                                add(format!("breast/{stem}-{cup}-{firmness}"), &[cup_factor, firmness_factor]);
                            }
                        }
                    }
                }
            }
        }
        self.terms = terms;
    }

    fn add_detail_terms(&mut self) {
        for (stem, paired, endings) in DETAILS {
            let index = self.parameters.len();
            let name = stem.replace("{}-", "");
            self.parameters.push(Parameter::new(&name, ParameterKind::Detail, [-1.0, 1.0], 0.0));
            for (ending, sign) in endings.into_iter().zip([-1.0, 1.0]) {
                let sides: &[&str] = if paired { &["l", "r"] } else { &[""] };
                let names = sides.iter().map(|side| format!("{}-{ending}", stem.replace("{}", side))).collect();
                self.terms.push((names, vec![Factor::Part { parameter: index, sign }]));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{Factor, ParameterTable};
    use crate::Gender;

    #[test]
    fn macro_weights_are_a_partition_of_unity() {
        let table = ParameterTable::new(Gender::Female);
        let mut values: Vec<f64> = table.parameters.iter().map(|parameter| parameter.default).collect();
        values[0] = 0.8;
        values[1] = 0.3;
        values[2] = 0.9;
        let total = |prefix: &str| -> f64 {
            table
                .terms
                .iter()
                .filter(|(names, _)| names[0].starts_with(prefix))
                .map(|(_, factors)| factors.iter().map(|factor| factor.value(&values)).product::<f64>())
                .sum()
        };
        assert!((total("macrodetails/universal") - 1.0).abs() < 1e-12);
        assert!((total("breast/") - 1.0).abs() < 1e-12);
        let ancestries: f64 =
            ["african", "asian", "caucasian"].map(|name| total(&format!("macrodetails/{name}"))).iter().sum();
        assert!((ancestries - 1.0).abs() < 1e-12);
    }

    #[test]
    fn factor_derivatives_agree_with_finite_differences() {
        // Values away from the knots 0, 1/2 and 1, where the factors are smooth.
        let values = [0.3, 0.7, 0.2, -0.4];
        let all = [0, 1, 2];
        let factors = [
            Factor::Knots { parameter: 0, values: [1.0, 0.2, 0.7] },
            Factor::Knots { parameter: 1, values: [1.0, 0.2, 0.7] },
            Factor::Share { parameter: 2, all },
            Factor::Part { parameter: 3, sign: -1.0 },
            Factor::Part { parameter: 3, sign: 1.0 },
        ];
        for factor in factors {
            for by in 0..values.len() {
                let step = 1e-6;
                let mut above = values;
                above[by] += step;
                let mut below = values;
                below[by] -= step;
                let numeric = (factor.value(&above) - factor.value(&below)) / (2.0 * step);
                assert!((factor.derivative(&values, by) - numeric).abs() < 1e-8, "{factor:?} by {by}");
            }
        }
    }
}

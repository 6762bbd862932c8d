//! Size and ease: where between its drawn sizes and cuts a garment lies.

use modiste_core::Vec2;

use super::GradedPattern;

/// A cut that is drawn: how much wider than the body the garment is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Cut {
    /// Close to the body.
    Slim,
    /// As it is usually worn.
    Regular,
    /// Wide.
    Loose,
}

impl Cut {
    /// All cuts, from close to wide.
    pub const ALL: [Self; 3] = [Self::Slim, Self::Regular, Self::Loose];

    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Slim => "slim",
            Self::Regular => "regular",
            Self::Loose => "loose",
        }
    }

    /// Where it lies on the axis from slim, -1, to loose, 1.
    pub fn ease(self) -> f64 {
        match self {
            Self::Slim => -1.0,
            Self::Regular => 0.0,
            Self::Loose => 1.0,
        }
    }

    /// The outer cut that an ease lies towards, and how much of the way from the regular one, at most all of it.
    fn towards(ease: f64) -> (Self, f64) {
        (if ease < 0.0 { Self::Slim } else { Self::Loose }, ease.abs().min(1.0))
    }
}

/// A size and an ease, both continuous.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Fitting {
    /// Index into the sizes of the pattern, or between two: 3.4 is on the way from size 3 to size 4.
    pub size: f64,
    /// From slim, -1, over regular, 0, to loose, 1.
    pub ease: f64,
}

impl From<f64> for Fitting {
    /// The regular cut of a size.
    fn from(size: f64) -> Self {
        Self { size, ease: 0.0 }
    }
}

impl GradedPattern {
    /// Whether the pattern is drawn in all cuts, so that its garment has an ease.
    pub fn has_ease(&self) -> bool {
        !self.panels.is_empty() && self.panels.iter().all(|panel| !panel.slim.is_empty() && !panel.loose.is_empty())
    }

    /// The pattern in its regular cut alone.
    #[must_use]
    pub fn regular(&self) -> Self {
        let mut pattern = self.clone();
        for panel in &mut pattern.panels {
            panel.slim.clear();
            panel.loose.clear();
        }
        pattern
    }

    /// Points in panel space (m) between those of the drawn sizes and cuts, which `drawn` gives. Where the pattern has one
    /// cut alone the ease counts for nothing.
    pub(crate) fn at<'a>(&self, fitting: Fitting, drawn: impl Fn(Cut, usize) -> &'a Vec<Vec2>) -> Vec<Vec2> {
        let ([lower, upper], share) = self.between(fitting.size);
        let in_cut = |cut: Cut| {
            let pairs = drawn(cut, lower).iter().zip(drawn(cut, upper));
            pairs.map(|(a, b)| a.lerp(*b, share)).collect::<Vec<Vec2>>()
        };
        let mut points = in_cut(Cut::Regular);
        let (cut, way) = Cut::towards(fitting.ease);
        if way > 0.0 && self.has_ease() {
            points.iter_mut().zip(in_cut(cut)).for_each(|(point, outer)| *point = point.lerp(outer, way));
        }
        points
    }
}

#[cfg(test)]
mod tests {
    use super::{Cut, Fitting};
    use crate::pattern::{GARMENTS, builtin, signed_area};
    use modiste_body::Gender;

    #[test]
    fn looser_cuts_are_wider_and_the_way_between_is_even() {
        for (gender, garment) in Gender::ALL.into_iter().flat_map(|gender| GARMENTS.map(|garment| (gender, garment))) {
            let pattern = builtin(garment, gender).unwrap().unwrap();
            let area = |ease: f64| -> f64 {
                let size = pattern.template_size as f64;
                let corners = (0..pattern.panels.len()).map(|panel| pattern.corners(panel, Fitting { size, ease }));
                corners.map(|corners| signed_area(&corners).abs()).sum()
            };
            let [slim, half, regular, loose] = [-1.0, -0.5, 0.0, 1.0].map(area);
            assert!(slim < half && half < regular && regular < loose, "{garment}");
            assert!((half - 0.5 * (slim + regular)).abs() < 0.01 * regular, "{garment}: {slim} {half} {regular}");
            // Nothing beyond the cuts that are drawn.
            assert!((area(3.0) - loose).abs() < 1e-12 && (area(-3.0) - slim).abs() < 1e-12);
        }
    }

    #[test]
    fn a_pattern_of_one_cut_does_not_hear_of_ease() {
        let whole = builtin("skirt", Gender::Female).unwrap().unwrap();
        let regular = whole.regular();
        assert!(whole.has_ease() && !regular.has_ease());
        let fitting = Fitting { size: 4.3, ease: 0.7 };
        assert_eq!(regular.corners(0, fitting), whole.corners(0, 4.3.into()));
        assert_ne!(whole.corners(0, fitting), whole.corners(0, 4.3.into()));
        assert!(regular.check().is_ok());
        let mut torn = whole;
        torn.panels[1].loose.clear();
        assert!(torn.check().unwrap_err().to_string().contains("loose cut"));
        assert_eq!(Cut::ALL.map(Cut::name), ["slim", "regular", "loose"]);
    }
}

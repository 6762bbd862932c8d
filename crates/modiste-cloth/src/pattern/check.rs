//! What a pattern must satisfy before it is cut.

use modiste_core::Vec2;

use super::{Cut, EdgeId, GradedPattern, Stitch, signed_area};

/// Segments a curved edge is split into when looking for crossings.
const CHECK_SEGMENTS: usize = 16;

/// Why a pattern cannot be cut or sewn.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum PatternFault {
    /// A panel has another number of outlines than there are sizes, or of vertices, curves and labels.
    #[error("panel {panel}: {what} should be {wanted}, found {found}")]
    Count {
        /// Name of the panel.
        panel: String,
        /// What is counted.
        what: &'static str,
        /// The number wanted.
        wanted: usize,
        /// The number found.
        found: usize,
    },
    /// A seam, waist band or anchor names an edge that does not exist.
    #[error("edge {edge} of panel {panel} is named but does not exist")]
    NoSuchEdge {
        /// Index of the panel.
        panel: usize,
        /// Index of the edge.
        edge: usize,
    },
    /// An outline crosses itself.
    #[error("panel {panel} crosses itself in size {size}")]
    Crossing {
        /// Name of the panel.
        panel: String,
        /// Name of the size.
        size: String,
    },
    /// An outline has no area, is turned over in one size, or has a coordinate that is no number.
    #[error("panel {panel} has the signed area {area} m² in size {size}")]
    Area {
        /// Name of the panel.
        panel: String,
        /// Name of the size.
        size: String,
        /// Signed area (m²).
        area: f64,
    },
    /// Two corners of an outline lie on each other.
    #[error("panel {panel} has two corners in one place in size {size}: {a} and {b}")]
    SameCorner {
        /// Name of the panel.
        panel: String,
        /// Name of the size.
        size: String,
        /// First corner.
        a: usize,
        /// Second corner.
        b: usize,
    },
    /// An edge is sewn more than once: the cloth would branch.
    #[error("edge {edge} of panel {panel} is in more than one seam")]
    SewnTwice {
        /// Name of the panel.
        panel: String,
        /// Index of the edge.
        edge: usize,
    },
    /// A panel hangs by no seam.
    #[error("panel {panel} is sewn to nothing")]
    Loose {
        /// Name of the panel.
        panel: String,
    },
    /// The sides of a seam differ in length.
    #[error("seam {seam} of size {size} cannot be closed: {a} is {a_length:.4} m long, {b} is {b_length:.4} m")]
    SeamLength {
        /// Index of the stitch.
        seam: usize,
        /// Name of the size.
        size: String,
        /// First side.
        a: String,
        /// Second side.
        b: String,
        /// Length of the first side (m).
        a_length: f64,
        /// Length of the second side (m).
        b_length: f64,
    },
}

impl GradedPattern {
    /// [`GradedPattern::gather`] of seams whose sides are equal but for the ease of a sleeve cap.
    pub const PLAIN_SEAMS: f64 = 1.03;

    /// Checks counts, indices, areas, crossings and seam lengths in every size.
    ///
    /// # Errors
    /// The first [`PatternFault`] found.
    pub fn check(&self) -> Result<(), PatternFault> {
        self.check_counts()?;
        for (panel, cut) in self.panels.iter().flat_map(|panel| Cut::ALL.map(|cut| (panel, cut))) {
            for (size, outline) in self.sizes.iter().zip(panel.in_cut(cut)) {
                let polygon = outline.polygon(CHECK_SEGMENTS);
                let area = signed_area(&polygon);
                let turned = area.signum() * panel.orientation() < 0.0;
                if !area.is_finite() || area.abs() < 1e-6 || turned {
                    return Err(PatternFault::Area { panel: panel.name.clone(), size: size.name.clone(), area });
                }
                if let Some([a, b]) = same_corner(&outline.vertices) {
                    let (panel, size) = (panel.name.clone(), size.name.clone());
                    return Err(PatternFault::SameCorner { panel, size, a, b });
                }
                if crosses_itself(&polygon) {
                    return Err(PatternFault::Crossing { panel: panel.name.clone(), size: size.name.clone() });
                }
            }
        }
        self.check_connected()?;
        let cuts = Cut::ALL.into_iter().filter(|&cut| cut == Cut::Regular || self.has_ease());
        for cut in cuts {
            for seam in 0..self.stitches.len() {
                (0..self.sizes.len()).try_for_each(|size| self.check_seam(seam, cut, size))?;
            }
        }
        Ok(())
    }

    /// Lengths (m) of the two sides of a stitch in a size of a cut that the pattern has.
    pub fn seam_lengths(&self, stitch: &Stitch, cut: Cut, size: usize) -> [f64; 2] {
        stitch.sides.map(|side| self.panels[side.panel].in_cut(cut)[size].edge_length(side.edge))
    }

    fn check_counts(&self) -> Result<(), PatternFault> {
        let count = |panel: &str, what, wanted, found| {
            if wanted == found {
                return Ok(());
            }
            Err(PatternFault::Count { panel: panel.to_owned(), what, wanted, found })
        };
        // All panels have three cuts, or none has.
        let has_cuts = self.panels.iter().any(|panel| !(panel.slim.is_empty() && panel.loose.is_empty()));
        let outer = if has_cuts { self.sizes.len() } else { 0 };
        for panel in &self.panels {
            let edges = panel.edge_labels.len();
            count(&panel.name, "number of outlines", self.sizes.len(), panel.outlines.len())?;
            count(&panel.name, "number of outlines of the slim cut", outer, panel.slim.len())?;
            count(&panel.name, "number of outlines of the loose cut", outer, panel.loose.len())?;
            for outline in panel.outlines.iter().chain(&panel.slim).chain(&panel.loose) {
                count(&panel.name, "number of vertices", edges, outline.vertices.len())?;
                count(&panel.name, "number of curves", edges, outline.curves.len())?;
            }
            for lower in &panel.lower_parts {
                count(&panel.name, "number of part heights", self.sizes.len(), lower.below.len())?;
            }
        }
        let seams = self.stitches.iter().flat_map(|stitch| stitch.sides);
        let others = self
            .waist_band
            .iter()
            .copied()
            .chain(self.anchors.iter().map(|a| a.edge))
            .chain(self.ribs.iter().map(|r| r.edge));
        for id in seams.chain(others) {
            if self.panels.get(id.panel).is_none_or(|panel| id.edge >= panel.edge_labels.len()) {
                return Err(PatternFault::NoSuchEdge { panel: id.panel, edge: id.edge });
            }
        }
        Ok(())
    }

    /// Every edge is in one seam at most, and every panel in one at least where there are several.
    fn check_connected(&self) -> Result<(), PatternFault> {
        let mut sides: Vec<EdgeId> = Vec::new();
        for side in self.stitches.iter().flat_map(|stitch| stitch.sides) {
            if sides.contains(&side) {
                return Err(PatternFault::SewnTwice { panel: self.panels[side.panel].name.clone(), edge: side.edge });
            }
            sides.push(side);
        }
        let is_loose = |panel: usize| self.panels.len() > 1 && sides.iter().all(|side| side.panel != panel);
        match (0..self.panels.len()).find(|&panel| is_loose(panel)) {
            Some(panel) => Err(PatternFault::Loose { panel: self.panels[panel].name.clone() }),
            None => Ok(()),
        }
    }

    fn check_seam(&self, seam: usize, cut: Cut, size: usize) -> Result<(), PatternFault> {
        let stitch = &self.stitches[seam];
        let [a_length, b_length] = self.seam_lengths(stitch, cut, size);
        if a_length.max(b_length) <= self.gather * a_length.min(b_length) {
            return Ok(());
        }
        let [a, b] = stitch.sides.map(|side| {
            let panel = &self.panels[side.panel];
            format!("{} edge {} {}", panel.name, side.edge, panel.edge_labels[side.edge])
        });
        Err(PatternFault::SeamLength { seam, size: self.sizes[size].name.clone(), a, b, a_length, b_length })
    }
}

/// Corners nearer to each other than this (m) cannot be meshed.
const SAME: f64 = 1e-5;

fn same_corner(corners: &[Vec2]) -> Option<[usize; 2]> {
    let pairs = (0..corners.len()).flat_map(|a| (a + 1..corners.len()).map(move |b| [a, b]));
    pairs.into_iter().find(|&[a, b]| corners[a].distance(corners[b]) < SAME)
}

/// Whether two segments of a closed polygon cross; neighbours only touch.
pub(crate) fn crosses_itself(polygon: &[Vec2]) -> bool {
    let count = polygon.len();
    let segment = |i: usize| (polygon[i], polygon[(i + 1) % count]);
    (0..count).any(|i| {
        let (a, b) = segment(i);
        (i + 2..count).any(|j| {
            if i == 0 && j == count - 1 {
                return false;
            }
            let (c, d) = segment(j);
            let side = |p: Vec2, q: Vec2, r: Vec2| (q - p).perp_dot(r - p);
            side(a, b, c) * side(a, b, d) < 0.0 && side(c, d, a) * side(c, d, b) < 0.0
        })
    })
}

#[cfg(test)]
mod tests {
    use super::{Cut, PatternFault, crosses_itself};
    use crate::pattern::builtin::draft;
    use crate::pattern::{GARMENTS, draft_shorts, draft_tshirt};
    use modiste_body::Gender;
    use modiste_core::Vec2;

    #[test]
    fn all_drafts_can_be_sewn_in_every_size() {
        for gender in Gender::ALL {
            for garment in GARMENTS {
                let pattern = draft(garment, gender).unwrap();
                pattern.check().unwrap();
                assert!(pattern.sizes.len() >= 7);
                assert!(pattern.has_ease());
                for (stitch, cut) in pattern.stitches.iter().flat_map(|stitch| Cut::ALL.map(|cut| (stitch, cut))) {
                    for size in 0..pattern.sizes.len() {
                        let [a, b] = pattern.seam_lengths(stitch, cut, size);
                        assert!((a - b).abs() < 5e-4, "{} {cut:?} {stitch:?}: {a} {b}", pattern.garment);
                    }
                }
            }
        }
    }

    #[test]
    fn sizes_are_not_scaled_copies() {
        let pattern = draft_tshirt(Gender::Female);
        let (small, large) = (&pattern.panels[0].outlines[0], &pattern.panels[0].outlines[16]);
        let width = |o: &crate::pattern::Outline| o.vertices[2].x;
        let length = |o: &crate::pattern::Outline| -o.vertices[0].y;
        assert!(width(large) / width(small) > 1.6);
        assert!(length(large) / length(small) < 1.2);
    }

    #[test]
    fn a_crossing_and_an_unequal_seam_are_found() {
        assert!(crosses_itself(&[Vec2::ZERO, Vec2::new(1.0, 1.0), Vec2::new(1.0, 0.0), Vec2::new(0.0, 1.0)]));
        assert!(!crosses_itself(&[Vec2::ZERO, Vec2::new(1.0, 0.0), Vec2::new(1.0, 1.0), Vec2::new(0.0, 1.0)]));
        let mut pattern = draft_shorts(Gender::Male);
        let hem = pattern.panels[0].edge_labelled("hem").unwrap();
        pattern.panels[0].outlines[3].vertices[hem].y -= 0.05;
        assert!(matches!(pattern.check(), Err(PatternFault::SeamLength { .. })));
        pattern.panels[1].outlines.pop();
        assert!(matches!(pattern.check(), Err(PatternFault::Count { .. })));
    }
}

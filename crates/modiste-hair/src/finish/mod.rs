//! The last pass: no point of the hair ends inside body or clothing, by their triangles.

mod cells;
mod closed;
mod sheet;
mod slab;

use modiste_core::{SurfacePoint, Vec3, bounds};
use rayon::prelude::*;

use crate::POINTS;
use crate::surface::Surface;
pub(crate) use cells::Cells;
use cells::Standing;
use sheet::Sheet;

/// Distance that points keep from skin and cloth after the pass (m).
pub const GAP: f64 = 0.0008;
/// How much further points are moved than they must (m), so that what a frame stores as f32 and what faces at an angle leave
/// does not bring them back.
const DOUBT: f64 = 0.0002;
/// Rounds that a point gets: a fold leads from one face into another, cloth into skin and skin into cloth.
const ROUNDS: usize = 4;
/// Space around the points that is looked at too (m): where they may be moved to.
const AROUND: f64 = 0.05;

/// Lets points out of the skin and of what is worn over it.
///
/// A point that is told outside has been found outside by the winding number of the skin, whole or not at all (see `cells`),
/// and before every piece of cloth. One that finds no way out in a few rounds, in a fold of an armpit say, goes to the point
/// before it on its strand, which is outside, or to just above its root.
#[derive(Debug, Clone, Default)]
pub struct Finish {
    skin: Cells,
    sheets: Vec<Sheet>,
    /// The face nearest to each point in each sheet: for each point one for each sheet, one where there is no sheet.
    nearest: Vec<u32>,
    /// The face that each point last left the skin by.
    left: Vec<u32>,
}

/// Counts of a pass.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct FinishReport {
    /// Points whose nearest triangles were looked for.
    pub asked: usize,
    /// Points that were moved.
    pub moved: usize,
    /// Points among these that found no way out and went to the one before them.
    pub lost: usize,
}

impl FinishReport {
    fn join(self, other: Self) -> Self {
        Self { asked: self.asked + other.asked, moved: self.moved + other.moved, lost: self.lost + other.lost }
    }
}

impl Finish {
    /// Before the first frame.
    pub fn new() -> Self {
        Self::default()
    }

    /// Moves every point that is nearer than [`GAP`] to skin or cloth, or inside, out to a little more than that distance;
    /// roots stay. Points are `POINTS` per guide. Clothes keep their order from frame to frame.
    ///
    /// Points and surfaces may be given in the moving frame of the bust, where both move least.
    pub fn apply(&mut self, points: &mut [Vec3], skin: &Surface, clothes: &[&Surface]) -> FinishReport {
        self.look_around(skin, bounds(points).unwrap_or((Vec3::ZERO, Vec3::ZERO)));
        self.apply_there(points, skin, clothes)
    }

    /// Gets ready for a frame with points in the box from `low` to `high` (m).
    pub(crate) fn look_around(&mut self, skin: &Surface, (low, high): (Vec3, Vec3)) {
        self.skin.build(skin.topology(), skin.vertices(), (low - AROUND, high + AROUND), GAP + DOUBT);
    }

    /// The space about the skin, as it was last made ready.
    pub(crate) fn skin(&self) -> &Cells {
        &self.skin
    }

    /// The same as [`Self::apply`] for a frame that is ready.
    pub(crate) fn apply_there(&mut self, points: &mut [Vec3], skin: &Surface, clothes: &[&Surface]) -> FinishReport {
        let width = clothes.len().max(1);
        if self.left.len() != points.len() || self.sheets.len() != clothes.len() {
            self.sheets = vec![Sheet::default(); clothes.len()];
            self.nearest = vec![0; points.len() * width];
            self.left = vec![0; points.len()];
        }
        if !clothes.is_empty() {
            let (low, high) = bounds(points).unwrap_or((Vec3::ZERO, Vec3::ZERO));
            for (sheet, cloth) in self.sheets.iter_mut().zip(clothes) {
                sheet.prepare(cloth, (low - AROUND, high + AROUND));
            }
        }
        let Self { skin: cells, sheets, nearest, left } = self;
        let pass = Pass { cells, skin, sheets, clothes };
        points
            .par_chunks_mut(POINTS)
            .zip(left.par_chunks_mut(POINTS))
            .zip(nearest.par_chunks_mut(POINTS * width))
            .with_min_len(16)
            .map(|((strand, left), nearest)| pass.let_out(strand, left, nearest))
            .reduce(FinishReport::default, FinishReport::join)
    }
}

/// Everything that is the same for all points of a frame.
struct Pass<'a> {
    cells: &'a Cells,
    skin: &'a Surface,
    sheets: &'a [Sheet],
    clothes: &'a [&'a Surface],
}

impl Pass<'_> {
    fn let_out(&self, strand: &mut [Vec3], left: &mut [u32], nearest: &mut [u32]) -> FinishReport {
        let mut report = FinishReport::default();
        let mut last = None;
        for index in 1..strand.len() {
            let nearest = &mut nearest[index * self.sheets.len()..][..self.sheets.len()];
            let start = strand[index];
            if self.sheets.is_empty() && self.cells.is_free(start) {
                last = Some(start);
                continue;
            }
            let (end, asked) = self.way_out(start, &mut left[index], nearest);
            report.asked += usize::from(asked);
            let above_root = || self.out_of_skin(strand[0], self.cells.standing(strand[0], GAP), &mut left[0]);
            let point = end.or(last).or_else(above_root).unwrap_or(start);
            report.lost += usize::from(end.is_none());
            report.moved += usize::from(point != start);
            strand[index] = point;
            last = Some(point);
        }
        report
    }

    /// Where a point ends, if it finds its way out, and whether triangles were looked for.
    fn way_out(&self, start: Vec3, left: &mut u32, nearest: &mut [u32]) -> (Option<Vec3>, bool) {
        let (mut p, mut asked) = (start, false);
        let mut standing = self.cells.standing(p, GAP);
        for _ in 0..ROUNDS {
            let mut moved = false;
            if !matches!(standing, Standing::Clear) {
                asked = true;
                if let Some(free) = self.out_of_skin(p, standing, left) {
                    (p, moved) = (free, true);
                }
            }
            for ((sheet, cloth), likely) in self.sheets.iter().zip(self.clothes).zip(nearest.iter_mut()) {
                let (free, looked) = sheet.way_out(cloth, p, likely);
                asked |= looked;
                if let Some(free) = free {
                    (p, moved) = (free, true);
                }
            }
            if !moved && p == start {
                return (Some(p), asked);
            }
            if !moved {
                break;
            }
            standing = self.cells.standing(p, GAP);
            if self.sheets.is_empty() && matches!(standing, Standing::Clear) {
                return (Some(p), asked);
            }
        }
        // In a narrow place there is no room for the gap on both sides, but it may still be outside.
        let outside = !self.is_inside(p) && self.clothes.iter().all(|cloth| !cloth.is_behind(p));
        (outside.then_some(p), asked)
    }

    /// Where a point goes that is inside the skin or too near to it; `likely` is the face that it left by in the last frame.
    fn out_of_skin(&self, p: Vec3, standing: Standing, likely: &mut u32) -> Option<Vec3> {
        let beside = |at: &SurfacePoint, way: Vec3| {
            let way = if at.distance > 1e-7 { way / at.distance } else { self.cells.normal(at.face) };
            at.point + (GAP + DOUBT) * way
        };
        match standing {
            Standing::Clear => None,
            Standing::Near(at) => Some(beside(&at, p - at.point)),
            Standing::Inside(at, sure) => {
                let (tree, x) = (self.skin.tree(), self.skin.vertices());
                let nearest = match at {
                    Some(at) if sure => at,
                    _ => tree.closest_point_near(x, p, f64::INFINITY, Some(at.map_or(*likely, |at| at.face)))?,
                };
                *likely = nearest.face;
                let free = beside(&nearest, nearest.point - p);
                if !self.is_inside(free) {
                    return Some(free);
                }
                // That face is itself inside, where parts have sunk into each other.
                let place = |face: u32, at: Vec3| at + (GAP + DOUBT) * self.cells.normal(face);
                let visible =
                    |face: u32, at: Vec3| !self.cells.is_covered(face, GAP + DOUBT) && !self.is_inside(place(face, at));
                let at = tree.closest_point_where(x, p, f64::INFINITY, Some(*likely), visible)?;
                *likely = at.face;
                Some(place(at.face, at.point))
            }
            Standing::Unknown => {
                let contact = self.skin.contact(p, f64::INFINITY, None)?;
                (contact.distance < GAP).then(|| contact.at.point + (GAP + DOUBT) * contact.outwards)
            }
        }
    }

    fn is_inside(&self, p: Vec3) -> bool {
        self.cells.is_inside(p).unwrap_or_else(|| self.skin.tree().contains(self.skin.vertices(), p))
    }
}

#[cfg(test)]
mod tests {
    use super::{Finish, GAP};
    use crate::POINTS;
    use crate::surface::Surface;
    use modiste_core::shapes::icosphere;
    use modiste_core::{Topology, Vec3, normal, seeded_rng, winding_number_exact};
    use std::sync::Arc;

    fn cloud(count: usize, radius: f64) -> Vec<Vec3> {
        let mut rng = seeded_rng(9);
        (0..count * POINTS)
            .map(|_| {
                radius
                    * Vec3::new(normal(&mut rng), normal(&mut rng), normal(&mut rng)).normalize()
                    * (1.0 + 0.2 * normal(&mut rng))
            })
            .collect()
    }

    #[test]
    fn no_point_stays_inside_a_ball_or_behind_cloth_and_the_frames_before_change_nothing() {
        let ball = icosphere(4);
        let at = |radius: f64, t: f64| -> Vec<Vec3> {
            ball.vertices.iter().map(|v| radius * *v + Vec3::new(0.004 * t, 0.0, 0.0)).collect()
        };
        let mut skin = Surface::new(&ball.topology, at(0.1, 0.0));
        // A shell of cloth around the upper half.
        let upper = ball.topology.faces().iter().filter(|face| face.iter().all(|&v| ball.vertices[v as usize].y > 0.0));
        let upper = Arc::new(Topology::new(ball.vertices.len(), upper.copied().collect()).unwrap());
        let mut cloth = Surface::sheet(&upper, at(0.11, 0.0));
        let base = cloud(40, 0.11);
        let mut finish = Finish::new();
        for frame in 0..12 {
            let t = f64::from(frame);
            skin.set(&at(0.1, t));
            cloth.set(&at(0.11, t));
            let mut points: Vec<Vec3> =
                base.iter().map(|p| *p + Vec3::new(0.005 * t, 0.003 * (t * 0.7).sin(), 0.0)).collect();
            let mut plain = points.clone();
            let report = finish.apply(&mut points, &skin, &[&cloth]);
            assert!(report.moved > 50 && report.asked < points.len(), "{report:?}");
            Finish::new().apply(&mut plain, &skin, &[&cloth]);
            for (index, (point, plain)) in points.iter().zip(&plain).enumerate() {
                assert!(point.distance(*plain) < 1e-9, "point {index}");
                if index % POINTS != 0 {
                    for surface in [&skin, &cloth] {
                        assert!(surface.contact(*point, 1.0, None).unwrap().distance >= GAP - 1e-6, "point {index}");
                    }
                }
            }
        }
    }

    #[test]
    fn parts_that_have_sunk_into_each_other_let_every_point_out() {
        let ball = icosphere(4);
        let n = ball.vertices.len() as u32;
        let faces = ball.topology.faces().iter().copied();
        let two = faces.clone().chain(faces.map(|face| face.map(|vertex| vertex + n))).collect();
        let topology = Arc::new(Topology::new(2 * n as usize, two).unwrap());
        let other = ball.vertices.iter().map(|v| 0.05 * *v + Vec3::new(0.12, 0.0, 0.0));
        let x: Vec<Vec3> = ball.vertices.iter().map(|v| 0.1 * *v).chain(other).collect();
        let skin = Surface::new(&topology, x);
        let mut points = cloud(60, 0.09);
        let report = Finish::new().apply(&mut points, &skin, &[]);
        assert!(report.moved > 300, "{report:?}");
        for (index, p) in points.iter().enumerate().filter(|(index, _)| index % POINTS != 0) {
            assert!(winding_number_exact(&topology, skin.vertices(), *p) < 0.5, "point {index}: {p}");
            let at = skin.tree().closest_point(skin.vertices(), *p, 1.0).unwrap();
            assert!(at.distance > GAP - 1e-6, "point {index}: {}", at.distance);
        }
    }

    #[test]
    fn between_folds_without_room_no_point_is_before_one_and_as_far_behind_the_other() {
        // Two sheets that face each other 1 mm apart, in one mesh; a point between them is before both, beyond them behind one.
        let corner = |x: f64, y: f64, z: f64| Vec3::new(x, y, z);
        let x: Vec<Vec3> = [0.0, 0.001]
            .into_iter()
            .flat_map(|x| [corner(x, 0.0, 0.0), corner(x, 0.1, 0.0), corner(x, 0.1, 0.1), corner(x, 0.0, 0.1)])
            .collect();
        let faces = vec![[0, 1, 2], [0, 2, 3], [4, 6, 5], [4, 7, 6]];
        let cloth = Surface::sheet(&Arc::new(Topology::new(8, faces).unwrap()), x);
        let ball = icosphere(2);
        let skin = Surface::new(&ball.topology, ball.vertices.iter().map(|v| 0.02 * *v - Vec3::X).collect());
        let mut rng = seeded_rng(6);
        let mut points: Vec<Vec3> = (0..30 * POINTS)
            .map(|index| {
                let spread = if index % POINTS < 2 { 0.2 } else { 0.002 * normal(&mut rng) };
                Vec3::new(0.0005 + spread, 0.05 + 0.01 * normal(&mut rng), 0.05 + 0.01 * normal(&mut rng))
            })
            .collect();
        Finish::new().apply(&mut points, &skin, &[&cloth]);
        for (index, p) in points.iter().enumerate() {
            for off in [Vec3::X, Vec3::NEG_X].map(|way| 1e-6 * way) {
                let contact = cloth.contact(*p + off, 0.03, None);
                assert!(contact.is_none_or(|contact| contact.distance >= 0.0), "point {index}: {p}");
            }
        }
    }
}

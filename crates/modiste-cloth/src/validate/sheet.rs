//! Rectangles of cloth.

use crate::{Bend, BodyCollider, ClothError, ClothModel, ClothState, Fabric, Solver, SolverOptions, Stretch};
use modiste_core::{Topology, Vec2, Vec3};
use std::sync::Arc;

/// A rectangle of cloth in the plane z = 0, its first corner at the origin: x across (weft), y along (warp).
///
/// Rows are staggered so that the triangles are nearly equilateral where the cells are; odd rows have one vertex more.
pub(super) struct Sheet {
    pub(super) model: ClothModel,
    pub(super) state: ClothState,
    pub(super) columns: usize,
    pub(super) rows: usize,
}

impl Sheet {
    /// A rectangle of `size` (m) with `columns` × `rows` cells.
    pub(super) fn new(size: Vec2, cells: [usize; 2], fabric: &Fabric) -> Result<Self, ClothError> {
        Self::cut_at(std::f64::consts::FRAC_PI_2, size, cells, fabric)
    }

    /// A rectangle whose second side lies at `angle` (rad) from the weft.
    pub(super) fn cut_at(
        angle: f64,
        size: Vec2,
        [columns, rows]: [usize; 2],
        fabric: &Fabric,
    ) -> Result<Self, ClothError> {
        let cell = size / Vec2::new(columns as f64, rows as f64);
        let mut flat = Vec::new();
        for row in 0..=rows {
            let shift = if row % 2 == 1 { 0.5 } else { 0.0 };
            let count = columns + 1 + row % 2;
            flat.extend(
                (0..count).map(|i| Vec2::new((i as f64 - shift).clamp(0.0, columns as f64), row as f64) * cell),
            );
        }
        let mut faces = Vec::new();
        for row in 0..rows {
            let (a, b) = (first_of_row(columns, row), first_of_row(columns, row + 1));
            // The row with more vertices has one triangle more; triangles alternate along the strip between the rows.
            let (wide, narrow, up) = if row % 2 == 1 { (a, b, true) } else { (b, a, false) };
            for i in 0..=columns {
                let wide_face = [wide + i, wide + i + 1, narrow + i];
                faces.push(if up { wide_face } else { [wide_face[1], wide_face[0], wide_face[2]] });
                if i < columns {
                    let narrow_face = [narrow + i + 1, narrow + i, wide + i + 1];
                    faces.push(if up { narrow_face } else { [narrow_face[1], narrow_face[0], narrow_face[2]] });
                }
            }
        }
        #[expect(clippy::cast_possible_truncation, reason = "small meshes")]
        let faces: Vec<[u32; 3]> = faces.into_iter().map(|face| face.map(|v| v as u32)).collect();
        // Across and along the rectangle, in the fabric's own directions.
        let (sin, cos) = angle.sin_cos();
        let (across, along) = (Vec2::new(sin, -cos), Vec2::new(cos, sin));
        let in_fabric = |p: Vec2| p.x * across + p.y * along;
        let rest = faces.iter().map(|face| face.map(|v| in_fabric(flat[v as usize]))).collect();
        let topology = Topology::new(flat.len(), faces);
        let topology = topology.unwrap_or_else(|_| unreachable!("rows are joined by their own vertices"));
        let model = ClothModel::new(Arc::new(topology), rest, fabric)?;
        let state = ClothState::at_rest(flat.iter().map(|p| p.extend(0.0)).collect());
        Ok(Self { model, state, columns, rows })
    }

    /// The vertices of a row.
    #[expect(clippy::cast_possible_truncation, reason = "small meshes")]
    pub(super) fn row(&self, row: usize) -> Vec<u32> {
        (first_of_row(self.columns, row)..first_of_row(self.columns, row + 1)).map(|vertex| vertex as u32).collect()
    }

    /// Mean position of a row (m).
    pub(super) fn row_centre(&self, row: usize) -> Vec3 {
        let row = self.row(row);
        row.iter().map(|&v| self.state.positions[v as usize]).sum::<Vec3>() / row.len() as f64
    }

    /// Steps until nothing is faster than `speed` (m/s) for some frames (a turning point is not rest), or for `frames` frames.
    pub(super) fn rest(
        &mut self,
        solver: &mut Solver,
        body: &mut BodyCollider,
        (frames, speed): (usize, f64),
    ) -> Result<(), ClothError> {
        let mut quiet = 0;
        for _ in 0..frames {
            let fast = solver.step(&self.model, &mut self.state, body, FRAME)?.max_speed >= speed;
            quiet = if fast { 0 } else { quiet + 1 };
            if quiet == QUIET_FRAMES {
                break;
            }
        }
        Ok(())
    }
}

/// Number of vertices before a row.
fn first_of_row(columns: usize, row: usize) -> usize {
    row * (columns + 1) + row / 2
}

/// Frames without motion that count as rest.
const QUIET_FRAMES: usize = 8;

/// Time of a frame (s).
pub(super) const FRAME: f64 = 1.0 / 30.0;

/// A linear membrane without Poisson effect: strips of it follow the one-dimensional theory exactly.
pub(super) fn plain_fabric(density: f64, young: f64, rigidity: f64) -> Fabric {
    Fabric {
        name: "plain".to_owned(),
        density,
        stretch: Stretch::isotropic(young, 0.0),
        bend: Bend::isotropic(rigidity),
        stretch_damping: 2e-3,
        bend_damping: 5e-3,
    }
}

/// Settings for finding rest to the last digit that f32 directions give.
pub(super) fn static_options() -> SolverOptions {
    SolverOptions { substeps: 5, air_drag: 2.0, tolerance: 1e-3, max_iterations: 400, ..SolverOptions::default() }
}

/// A flat closed box as an obstacle, its upper side at y = 0.
pub(super) fn table(half: f64) -> Result<BodyCollider, ClothError> {
    let corner = |index: usize| {
        let side = |bit: usize| if index >> bit & 1 == 1 { half } else { -half };
        Vec3::new(side(0), if index >> 1 & 1 == 1 { 0.0 } else { -half }, side(2))
    };
    let x: Vec<Vec3> = (0..8).map(corner).collect();
    let quads = [[2, 6, 7, 3], [0, 1, 5, 4], [0, 4, 6, 2], [1, 3, 7, 5], [0, 2, 3, 1], [4, 5, 7, 6]];
    let faces = quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
    let topology = Topology::new(8, faces);
    let topology = topology.unwrap_or_else(|_| unreachable!("the corners of a box are eight"));
    BodyCollider::new(Arc::new(topology), &x)
}

#[cfg(test)]
mod tests {
    use super::table;
    use modiste_core::{Vec3, volume};

    #[test]
    fn the_table_is_closed_and_faces_outward() {
        let table = table(2.0).unwrap();
        assert!((volume(table.topology(), table.positions()) - 32.0).abs() < 1e-12);
        let (_, distance) = table.closest(Vec3::new(0.3, 0.1, -0.4), 1.0).unwrap();
        assert!((distance - 0.1).abs() < 1e-12);
    }
}

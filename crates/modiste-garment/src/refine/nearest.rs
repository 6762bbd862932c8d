//! The nearest of many points, by a grid of cells.

use modiste_core::Vec3;

/// Edge of a cell (m): about the spacing of the vertices of a body.
const CELL: f64 = 0.02;
/// Most cells along one axis; larger clouds get larger cells.
const MAX_CELLS: f64 = 128.0;

/// Points sorted into the cells of a grid. Filled anew every frame without new memory.
#[derive(Debug, Clone, Default)]
pub(crate) struct NearestPoints {
    low: Vec3,
    cell: f64,
    cells: [usize; 3],
    starts: Vec<u32>,
    indices: Vec<u32>,
    points: Vec<Vec3>,
    cell_of: Vec<u32>,
}

impl NearestPoints {
    /// Sorts in the points named by `members`.
    pub(crate) fn fill(&mut self, points: &[Vec3], members: &[u32]) {
        self.cell_of.clear();
        self.starts.clear();
        self.indices.clear();
        self.points.clear();
        let mut span = None;
        for &member in members {
            let point = points[member as usize];
            let (low, high) = span.unwrap_or((point, point));
            span = Some((low.min(point), high.max(point)));
        }
        let Some((low, high)) = span.filter(|(low, high)| low.is_finite() && high.is_finite()) else {
            self.cells = [0; 3];
            return;
        };
        self.low = low;
        self.cell = CELL.max((high - low).max_element() / MAX_CELLS);
        self.cells = ((high - low) / self.cell).to_array().map(|length| length as usize + 1);
        let cell_count = self.cells.iter().product::<usize>();
        self.starts.resize(cell_count + 1, 0);
        for &member in members {
            let cell = self.index(self.coordinates(points[member as usize]));
            self.cell_of.push(cell as u32);
            self.starts[cell + 1] += 1;
        }
        for cell in 0..cell_count {
            self.starts[cell + 1] += self.starts[cell];
        }
        self.indices.resize(members.len(), 0);
        self.points.resize(members.len(), Vec3::ZERO);
        // Filling from the back with decreasing starts leaves each start where it belongs.
        for (&member, &cell) in members.iter().zip(&self.cell_of).rev() {
            let slot = &mut self.starts[cell as usize + 1];
            *slot -= 1;
            self.indices[*slot as usize] = member;
            self.points[*slot as usize] = points[member as usize];
        }
        self.starts.remove(0);
        self.starts.push(members.len() as u32);
    }

    fn coordinates(&self, point: Vec3) -> [usize; 3] {
        let scaled = ((point - self.low) / self.cell).to_array();
        std::array::from_fn(|axis| (scaled[axis].max(0.0) as usize).min(self.cells[axis] - 1))
    }

    fn index(&self, [x, y, z]: [usize; 3]) -> usize {
        (y * self.cells[2] + z) * self.cells[0] + x
    }

    /// The nearest point, by its index in what was filled in, and its squared distance (m²), if nearer than `limit` (m²).
    pub(crate) fn nearest(&self, point: Vec3, limit: f64) -> Option<(u32, f64)> {
        if self.cells[0] == 0 || !point.is_finite() {
            return None;
        }
        let centre = self.coordinates(point);
        let mut best = (u32::MAX, limit);
        let largest = *self.cells.iter().max()?;
        // The point may lie outside the grid; then the shells of cells are at least that much further away.
        let clamped = point.clamp(self.low, self.low + self.cell * Vec3::from_array(self.cells.map(|n| n as f64)));
        let outside = clamped.distance(point);
        for shell in 0..=largest {
            let reach = (shell as f64 - 1.0).max(0.0) * self.cell;
            if reach * reach + outside * outside > best.1 {
                break;
            }
            self.search_shell(point, centre, shell, &mut best);
        }
        (best.0 != u32::MAX).then_some(best)
    }

    fn search_shell(&self, point: Vec3, centre: [usize; 3], shell: usize, best: &mut (u32, f64)) {
        let range = |axis: usize| {
            let low = centre[axis].saturating_sub(shell);
            low..(centre[axis] + shell + 1).min(self.cells[axis])
        };
        let on_face = |axis: usize, at: usize| at.abs_diff(centre[axis]) == shell;
        for y in range(1) {
            for z in range(2) {
                let whole_row = on_face(1, y) || on_face(2, z);
                let row = self.index([0, y, z]);
                if whole_row {
                    let xs = range(0);
                    self.search_cells(point, row + xs.start..row + xs.end, best);
                } else {
                    for x in [centre[0].checked_sub(shell), Some(centre[0] + shell)].into_iter().flatten() {
                        if x < self.cells[0] {
                            self.search_cells(point, row + x..row + x + 1, best);
                        }
                    }
                }
            }
        }
    }

    /// Cells that follow each other along x follow each other in memory.
    fn search_cells(&self, point: Vec3, cells: std::ops::Range<usize>, best: &mut (u32, f64)) {
        let slots = self.starts[cells.start] as usize..self.starts[cells.end] as usize;
        for (candidate, &index) in self.points[slots.clone()].iter().zip(&self.indices[slots]) {
            let distance = candidate.distance_squared(point);
            if distance < best.1 {
                *best = (index, distance);
            }
        }
    }
}

/// The cloud of all points, for tests and short lists.
#[cfg(test)]
fn brute_force(points: &[Vec3], members: &[u32], point: Vec3) -> Option<f64> {
    members.iter().map(|&member| points[member as usize].distance_squared(point)).min_by(f64::total_cmp)
}

#[cfg(test)]
mod tests {
    use super::{NearestPoints, brute_force};
    use modiste_core::{Vec3, normal, seeded_rng};

    #[test]
    fn the_grid_agrees_with_trying_all() {
        let mut rng = seeded_rng(3);
        let mut draw = |scale: f64| Vec3::new(normal(&mut rng), normal(&mut rng), 0.3 * normal(&mut rng)) * scale;
        let mut grid = NearestPoints::default();
        for scale in [0.05, 0.3, 5.0] {
            let points: Vec<Vec3> = (0..600).map(|_| draw(scale)).collect();
            let members: Vec<u32> = (0..600).filter(|index| index % 3 != 0).collect();
            grid.fill(&points, &members);
            for _ in 0..300 {
                let query = draw(1.5 * scale);
                let (index, distance) = grid.nearest(query, f64::INFINITY).unwrap();
                assert!(index % 3 != 0);
                assert!((points[index as usize].distance_squared(query) - distance).abs() < 1e-15);
                let wanted = brute_force(&points, &members, query).unwrap();
                assert!((distance - wanted).abs() < 1e-12, "{distance} {wanted}");
                assert!(grid.nearest(query, 0.99 * wanted).is_none());
            }
        }
        grid.fill(&[], &[]);
        assert!(grid.nearest(Vec3::ZERO, f64::INFINITY).is_none());
    }
}

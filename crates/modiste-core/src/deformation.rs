//! Deformation gradients and the mesh that fits them best (DRAPE, Guan et al. 2012, §4).

use std::ops::{AddAssign, SubAssign};

use crate::components::{connected_components, nearest_link};
use crate::error::check_size;
use crate::mesh::{centroid, corners, surface_area};
use crate::{Lanes, Mat3, SolveError, SparseCholesky, Topology, Vec3};

/// Per face the matrix `A_t` that takes the edges and the normal of `source` to those of `target` (DRAPE eq. 1).
///
/// `A_t [Δx2, Δx3, Δx4] = [Δy2, Δy3, Δy4]`, where `Δx4 = Δx2 × Δx3` as in the paper: lengths normal to the face scale
/// like its area. Translation does not enter. Where a source face has no area its matrix is the identity.
pub fn deformation_gradients(topology: &Topology, source: &[Vec3], target: &[Vec3]) -> Vec<Mat3> {
    topology
        .faces()
        .iter()
        .map(|&face| {
            let frame = edge_frame(corners(face, source));
            if frame.determinant() > 0.0 { edge_frame(corners(face, target)) * frame.inverse() } else { Mat3::IDENTITY }
        })
        .collect()
}

/// `[Δx2, Δx3, Δx2 × Δx3]` of a triangle. Its determinant is the square of twice the area.
fn edge_frame([a, b, c]: [Vec3; 3]) -> Mat3 {
    let (first, second) = (b - a, c - a);
    Mat3::from_cols(first, second, first.cross(second))
}

/// The mesh whose edges match given deformation gradients best in the least-squares sense (DRAPE eq. 3), prefactored.
///
/// Minimises `sum_t sum_k |A_t Δx_tk - Δy_tk|²` over the vertices `y`, with k the two edges at the first corner of the
/// face. The third, virtual edge of the paper is a free unknown per face, so its term vanishes at the minimum and does
/// not move the vertices. The V×V matrix depends on the faces alone; it is factored once.
///
/// The sum does not change when a connected component is translated. Every component but the largest is therefore tied
/// to the largest by one more edge between two nearby vertices, deformed by the mean gradient of the faces at its end on
/// the largest. Such ties form a tree, so each is met exactly: they place eyes or teeth without bending anything. The
/// one translation that is left is fixed by the centroid of the vertices.
#[derive(Debug, Clone)]
pub struct GradientReconstruction {
    system: EdgeSystem,
}

/// Least squares over the edges of all faces, and the ties between components.
#[derive(Debug, Clone)]
pub struct EdgeSystem {
    factor: SparseCholesky,
    edges: Vec<FaceEdges>,
    links: Vec<Link>,
}

/// The two template edges of a face at its first corner, with the face's vertices in the order of the factor.
#[derive(Debug, Clone, Copy)]
struct FaceEdges {
    vertices: [u32; 3],
    edges: [Vec3; 2],
}

/// The tie of a component to the largest one.
#[derive(Debug, Clone)]
struct Link {
    /// Ends in the order of the factor: on the largest component, on the other.
    ends: [u32; 2],
    /// Template vector between them.
    edge: Vec3,
    /// Faces whose mean gradient deforms the edge.
    faces: Vec<u32>,
}

impl EdgeSystem {
    /// Factors the matrix of the edges plus `diagonal`, which fixes what the edges do not see.
    fn new(
        topology: &Topology,
        template: &[Vec3],
        diagonal: impl Iterator<Item = (usize, f64)>,
    ) -> Result<Self, SolveError> {
        let n = topology.vertex_count();
        check_size("vertices of the template", n, template.len())?;
        if n == 0 {
            return Err(SolveError::Empty { what: "the template" });
        }
        if let Some(index) = template.iter().position(|p| !p.is_finite()) {
            return Err(SolveError::NotFinite { what: "the template", index });
        }
        let mut triplets = Vec::with_capacity(topology.face_count() * 6 + n);
        let mut couple = |a: u32, b: u32| {
            let (low, high) = (a.min(b) as usize, a.max(b) as usize);
            triplets.extend([(low, low, 1.0), (high, high, 1.0), (high, low, -1.0)]);
        };
        for &[a, b, c] in topology.faces() {
            couple(a, b);
            couple(a, c);
        }
        let mut links = Vec::new();
        for ends in component_links(topology, template) {
            couple(ends[0], ends[1]);
            links.push(Link {
                ends,
                edge: template[ends[1] as usize] - template[ends[0] as usize],
                faces: topology.vertex_faces(ends[0] as usize).to_vec(),
            });
        }
        triplets.extend(diagonal.map(|(vertex, weight)| (vertex, vertex, weight)));
        let factor = SparseCholesky::new(n, &triplets)?;
        let place = factor.new_from_old();
        let edges = topology
            .faces()
            .iter()
            .map(|&face| {
                let [a, b, c] = corners(face, template);
                FaceEdges { vertices: face.map(|vertex| place[vertex as usize]), edges: [b - a, c - a] }
            })
            .collect();
        for link in &mut links {
            link.ends = link.ends.map(|vertex| place[vertex as usize]);
        }
        Ok(Self { factor, edges, links })
    }

    /// Writes the right-hand side of the normal equations, in the order of the factor.
    fn right_side(&self, gradients: &[Mat3], out: &mut [Vec3]) {
        assert_eq!(gradients.len(), self.edges.len(), "one gradient per face");
        assert_eq!(out.len(), self.factor.size(), "one place per vertex");
        out.fill(Vec3::ZERO);
        for (face, gradient) in self.edges.iter().zip(gradients) {
            face.add(face.edges.map(|edge| *gradient * edge), out);
        }
        self.add_ties(|face| gradients[face], out);
    }

    /// Begins a right-hand side, in the order of the factor: one place per vertex.
    pub fn start(&self, right: &mut Vec<Lanes>) {
        right.clear();
        right.resize(self.factor.size(), Lanes::default());
    }

    /// Adds where the gradient of a face takes its two edges (m) at its first corner, to the second and the third.
    #[inline(always)]
    pub fn add_edges(&self, face: usize, edges: [Vec3; 2], right: &mut [Lanes]) {
        self.edges[face].add(edges, right);
    }

    /// Adds the ties between components; `gradient` is asked about the faces at their ends.
    pub fn add_ties<T: Place>(&self, gradient: impl Fn(usize) -> Mat3, out: &mut [T]) {
        for link in &self.links {
            let deformed = if link.faces.is_empty() {
                link.edge
            } else {
                let sum: Vec3 = link.faces.iter().map(|&face| gradient(face as usize) * link.edge).sum();
                sum / link.faces.len() as f64
            };
            out[link.ends[0] as usize] -= deformed.into();
            out[link.ends[1] as usize] += deformed.into();
        }
    }

    /// From the right-hand side to the solution, in the order of the vertices.
    fn solve(&self, right: &mut [Lanes], out: &mut [Vec3]) {
        self.factor.substitute(right);
        for (&at, vertex) in self.factor.new_from_old().iter().zip(out) {
            *vertex = right[at as usize].to_vec3();
        }
    }
}

/// A place in a right-hand side.
pub trait Place: Copy + From<Vec3> + AddAssign + SubAssign {}

impl<T: Copy + From<Vec3> + AddAssign + SubAssign> Place for T {}

impl FaceEdges {
    /// Adds where the edges go to a right-hand side.
    #[inline(always)]
    fn add<T: Place>(&self, [first, second]: [Vec3; 2], out: &mut [T]) {
        out[self.vertices[0] as usize] -= (first + second).into();
        out[self.vertices[1] as usize] += first.into();
        out[self.vertices[2] as usize] += second.into();
    }
}

impl GradientReconstruction {
    /// Prefactors the least-squares problem for a template (m).
    ///
    /// # Errors
    /// A template of the wrong length, or with a coordinate that is not finite.
    pub fn new(topology: &Topology, template: &[Vec3]) -> Result<Self, SolveError> {
        // Any positive number here pins vertex 0 to the origin exactly: the other terms do not see a translation.
        Ok(Self { system: EdgeSystem::new(topology, template, std::iter::once((0, 1.0)))? })
    }

    /// Number of vertices.
    pub fn vertex_count(&self) -> usize {
        self.system.factor.size()
    }

    /// Number of faces.
    pub fn face_count(&self) -> usize {
        self.system.edges.len()
    }

    /// Writes the vertices (m) that fit one gradient per face best, with their centroid at the origin.
    ///
    /// # Panics
    /// If there is not one gradient per face and one place in `out` per vertex.
    pub fn reconstruct(&self, gradients: &[Mat3], out: &mut [Vec3]) {
        self.system.right_side(gradients, out);
        self.system.factor.solve_points_in_elimination_order(out);
        centre(out);
    }

    /// What a right-hand side is made with, from which [`Self::solve`] makes the vertices. Together they do what
    /// [`Self::reconstruct`] does, without a matrix per face in between.
    pub fn system(&self) -> &EdgeSystem {
        &self.system
    }

    /// From the right-hand side, which is written over, to the vertices (m), with their centroid at the origin.
    ///
    /// # Panics
    /// If there is not one place in `right` per vertex.
    pub fn solve(&self, right: &mut [Lanes], out: &mut [Vec3]) {
        self.system.solve(right, out);
        centre(out);
    }
}

/// Moves the centroid to the origin.
fn centre(vertices: &mut [Vec3]) {
    let centre = centroid(vertices);
    vertices.iter_mut().for_each(|vertex| *vertex -= centre);
}

/// The mesh whose edges match given deformation gradients and whose vertices lie near given places, prefactored.
///
/// Minimises `sum_t sum_k |A_t Δx_tk - Δy_tk|² + w sum_v |y_v - p_v|²`: a screened form of [`GradientReconstruction`]. What
/// is wider than `length` follows the places p, what is finer the gradients A; so small errors of gradients no longer add
/// up to large ones of places far from where the mesh is held.
#[derive(Debug, Clone)]
pub struct ScreenedReconstruction {
    system: EdgeSystem,
    weight: f64,
}

impl ScreenedReconstruction {
    /// Prefactors the problem for a template (m), with the length (m) between coarse and fine.
    ///
    /// The edges of a regular mesh of edge length h act as `-2h²` times the Laplacian, so `w = 2h²/length²`; h is that of
    /// equilateral triangles of the template's mean area.
    ///
    /// # Errors
    /// As [`GradientReconstruction::new`], a length that is not positive, or a template without area.
    pub fn new(topology: &Topology, template: &[Vec3], length: f64) -> Result<Self, SolveError> {
        check_size("vertices of the template", topology.vertex_count(), template.len())?;
        let area = surface_area(topology, template) / topology.face_count().max(1) as f64;
        let weight = 2.0 * (4.0 / 3.0f64.sqrt()) * area / (length * length);
        if !(weight.is_finite() && weight > 0.0) {
            return Err(SolveError::NotFinite { what: "the weight of the places", index: 0 });
        }
        let diagonal = (0..topology.vertex_count()).map(|vertex| (vertex, weight));
        Ok(Self { system: EdgeSystem::new(topology, template, diagonal)?, weight })
    }

    /// Writes the vertices (m) for one gradient per face and one place (m) per vertex.
    ///
    /// # Panics
    /// If there is not one gradient per face, and one place and one vertex in `out` per vertex.
    pub fn reconstruct(&self, gradients: &[Mat3], places: &[Vec3], out: &mut [Vec3]) {
        self.system.right_side(gradients, out);
        for (&at, place) in self.system.factor.new_from_old().iter().zip(places) {
            out[at as usize] += self.weight * *place;
        }
        self.system.factor.solve_points_in_elimination_order(out);
    }

    /// As [`GradientReconstruction::system`].
    pub fn system(&self) -> &EdgeSystem {
        &self.system
    }

    /// From the right-hand side, which is written over, and one place (m) per vertex to the vertices (m).
    ///
    /// # Panics
    /// If there is not one place per vertex, and one in `right`.
    pub fn solve(&self, places: &[Vec3], right: &mut [Lanes], out: &mut [Vec3]) {
        assert_eq!(places.len(), out.len(), "one place per vertex");
        for (&at, place) in self.system.factor.new_from_old().iter().zip(places) {
            right[at as usize] += (self.weight * *place).into();
        }
        self.system.solve(right, out);
    }
}

/// One pair of vertices per component but the largest: on the largest, and near to it on the other.
fn component_links(topology: &Topology, template: &[Vec3]) -> Vec<[u32; 2]> {
    let components = connected_components(topology);
    let Some(main) = (0..components.len()).rev().max_by_key(|&index| components[index].len()) else {
        return Vec::new();
    };
    let others = components.iter().enumerate().filter(|&(index, _)| index != main);
    others.map(|(_, vertices)| nearest_link(&components[main], vertices, template)).collect()
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::{GradientReconstruction, ScreenedReconstruction, deformation_gradients};
    use crate::mesh::centroid;
    use crate::shapes::{grid, icosphere};
    use crate::{
        Mat3, Matrix, SolveError, Topology, Vec3, connected_components, normal, ridge, rotation_from_vector, seeded_rng,
    };

    fn jittered(x: &[Vec3], amount: f64, seed: u64) -> Vec<Vec3> {
        let mut rng = seeded_rng(seed);
        x.iter().map(|&p| p + amount * Vec3::new(normal(&mut rng), normal(&mut rng), normal(&mut rng))).collect()
    }

    fn largest_distance(a: &[Vec3], b: &[Vec3]) -> f64 {
        a.iter().zip(b).map(|(p, q)| p.distance(*q)).fold(0.0, f64::max)
    }

    fn centred(x: &[Vec3]) -> Vec<Vec3> {
        let centre = centroid(x);
        x.iter().map(|&p| p - centre).collect()
    }

    #[test]
    fn gradients_take_edges_and_normal_to_the_target() {
        let mesh = icosphere(2);
        let target = jittered(&mesh.vertices, 0.05, 1);
        let gradients = deformation_gradients(&mesh.topology, &mesh.vertices, &target);
        for (&[a, b, c], gradient) in mesh.topology.faces().iter().zip(&gradients) {
            let edges = |x: &[Vec3]| [x[b as usize] - x[a as usize], x[c as usize] - x[a as usize]];
            let (from, to) = (edges(&mesh.vertices), edges(&target));
            assert!((*gradient * from[0]).distance(to[0]) < 1e-12);
            assert!((*gradient * from[1]).distance(to[1]) < 1e-12);
            assert!((*gradient * from[0].cross(from[1])).distance(to[0].cross(to[1])) < 1e-12);
        }
    }

    #[test]
    fn a_rotation_is_the_gradient_of_every_face() {
        let mesh = icosphere(1);
        let rotation = Mat3::from_axis_angle(Vec3::new(1.0, 2.0, -0.5).normalize(), 0.8);
        let target: Vec<Vec3> = mesh.vertices.iter().map(|&p| rotation * p + Vec3::new(3.0, -1.0, 2.0)).collect();
        for gradient in deformation_gradients(&mesh.topology, &mesh.vertices, &target) {
            assert!(gradient.abs_diff_eq(rotation, 1e-12));
        }
    }

    #[test]
    fn gradients_of_a_mesh_give_the_mesh_back() {
        for mesh in [icosphere(3), grid(9, 14)] {
            let target = jittered(&mesh.vertices, 0.03, 2);
            let gradients = deformation_gradients(&mesh.topology, &mesh.vertices, &target);
            let solver = GradientReconstruction::new(&mesh.topology, &mesh.vertices).unwrap();
            let mut out = vec![Vec3::ZERO; target.len()];
            solver.reconstruct(&gradients, &mut out);
            assert!(largest_distance(&out, &centred(&target)) < 1e-11);
        }
    }

    #[test]
    fn coarse_shape_comes_from_the_places_and_fine_shape_from_the_gradients() {
        let mesh = grid(41, 41);
        let extent = mesh.vertices.iter().fold(0.0f64, |most, x| most.max(x.x)) - mesh.vertices[0].x;
        let wave = |x: Vec3, count: f64, height: f64| height * (count * std::f64::consts::TAU * x.x / extent).sin();
        let raised = |wide: f64, fine: f64| -> Vec<Vec3> {
            let up = |x: &Vec3| *x + Vec3::Z * (wave(*x, 1.0, wide) + wave(*x, 8.0, fine));
            mesh.vertices.iter().map(up).collect()
        };
        let (size, solver) =
            (0.1 * extent, |length| ScreenedReconstruction::new(&mesh.topology, &mesh.vertices, length));
        let truth = raised(size, 0.5 * size);
        // Places without the fine waves, gradients without the wide one.
        let places = raised(size, 0.0);
        let gradients = deformation_gradients(&mesh.topology, &mesh.vertices, &raised(0.0, 0.5 * size));
        let error = |length: f64| {
            let mut out = vec![Vec3::ZERO; truth.len()];
            solver(length).unwrap().reconstruct(&gradients, &places, &mut out);
            out.iter().zip(&truth).map(|(a, b)| a.distance(*b)).sum::<f64>() / truth.len() as f64
        };
        let [short, between, long] = [0.002, 0.05, 2.0].map(|length| error(length * extent));
        assert!(short > 2.5 * between && long > 2.5 * between, "{short} {between} {long}");
        // Where both agree nothing is lost at any length.
        let gradients = deformation_gradients(&mesh.topology, &mesh.vertices, &truth);
        let mut out = vec![Vec3::ZERO; truth.len()];
        solver(0.3 * extent).unwrap().reconstruct(&gradients, &truth, &mut out);
        assert!(largest_distance(&out, &truth) < 1e-10);
        assert!(solver(0.0).is_err() && solver(f64::NAN).is_err());
    }

    #[test]
    fn agrees_with_the_dense_least_squares_of_the_definition() {
        let mesh = icosphere(1);
        let (x, faces) = (&mesh.vertices, mesh.topology.faces());
        let mut rng = seeded_rng(3);
        // Gradients that no mesh has, so that the residual does not vanish.
        let mut gradient =
            |_: &[u32; 3]| Mat3::IDENTITY + Mat3::from_cols_array(&[(); 9].map(|()| 0.3 * normal(&mut rng)));
        let gradients: Vec<Mat3> = faces.iter().map(&mut gradient).collect();
        let n = x.len();
        // Two rows per face, and one that puts the centroid at the origin.
        let mut rows = vec![];
        let mut targets = vec![];
        for (&[a, b, c], gradient) in faces.iter().zip(&gradients) {
            for end in [b, c] {
                let mut row = vec![0.0; n];
                (row[end as usize], row[a as usize]) = (1.0, -1.0);
                rows.push(row);
                targets.push((*gradient * (x[end as usize] - x[a as usize])).to_array());
            }
        }
        rows.push(vec![1.0; n]);
        targets.push([0.0; 3]);
        let expected = ridge(&Matrix::from_rows(&rows), &Matrix::from_rows(&targets), 0.0).unwrap();
        let mut out = vec![Vec3::ZERO; n];
        GradientReconstruction::new(&mesh.topology, x).unwrap().reconstruct(&gradients, &mut out);
        for (vertex, found) in out.iter().enumerate() {
            assert!(found.distance(Vec3::from_slice(expected.row(vertex))) < 1e-10);
        }
    }

    #[test]
    fn turning_the_gradients_turns_the_mesh() {
        let mesh = grid(6, 8);
        let target = jittered(&mesh.vertices, 0.05, 4);
        let mut gradients = deformation_gradients(&mesh.topology, &mesh.vertices, &target);
        // Not integrable.
        gradients.iter_mut().step_by(3).for_each(|gradient| *gradient *= 1.2);
        let solver = GradientReconstruction::new(&mesh.topology, &mesh.vertices).unwrap();
        let mut plain = vec![Vec3::ZERO; target.len()];
        solver.reconstruct(&gradients, &mut plain);
        let rotation = rotation_from_vector(Vec3::new(0.4, 1.9, -0.7));
        let turned_gradients: Vec<Mat3> = gradients.iter().map(|gradient| rotation * *gradient).collect();
        let mut turned = plain.clone();
        solver.reconstruct(&turned_gradients, &mut turned);
        let expected: Vec<Vec3> = plain.iter().map(|&p| rotation * p).collect();
        assert!(largest_distance(&turned, &expected) < 1e-12);
        assert!(centroid(&turned).length() < 1e-14);
    }

    /// A sphere, two small ones inside it as eyes would be, and a vertex without faces.
    fn in_pieces() -> (Topology, Vec<Vec3>) {
        let (head, eye) = (icosphere(2), icosphere(1));
        let (mut x, mut faces) = (head.vertices.clone(), head.topology.faces().to_vec());
        for side in [-1.0, 1.0] {
            let first = x.len() as u32;
            x.extend(eye.vertices.iter().map(|&p| 0.2 * p + Vec3::new(0.4 * side, 0.2, 0.8)));
            faces.extend(eye.topology.faces().iter().map(|face| face.map(|vertex| vertex + first)));
        }
        x.push(Vec3::new(0.1, 0.9, 0.1));
        (Topology::new(x.len(), faces).unwrap(), x)
    }

    #[test]
    fn pieces_follow_an_affine_motion_of_the_whole() {
        let (topology, x) = in_pieces();
        let affine = rotation_from_vector(Vec3::new(1.0, 0.2, 0.3)) * Mat3::from_diagonal(Vec3::new(1.3, 0.8, 1.1));
        let target: Vec<Vec3> = x.iter().map(|&p| affine * p).collect();
        let solver = GradientReconstruction::new(&topology, &x).unwrap();
        let mut out = vec![Vec3::ZERO; x.len()];
        solver.reconstruct(&vec![affine; topology.face_count()], &mut out);
        assert!(largest_distance(&out, &centred(&target)) < 1e-12);
    }

    #[test]
    fn the_tie_of_a_piece_does_not_bend_it() {
        let (topology, x) = in_pieces();
        let target = jittered(&x, 0.02, 5);
        let gradients = deformation_gradients(&topology, &x, &target);
        let mut out = vec![Vec3::ZERO; x.len()];
        GradientReconstruction::new(&topology, &x).unwrap().reconstruct(&gradients, &mut out);
        for component in connected_components(&topology) {
            let pick = |points: &[Vec3]| -> Vec<Vec3> { component.iter().map(|&v| points[v as usize]).collect() };
            assert!(largest_distance(&centred(&pick(&out)), &centred(&pick(&target))) < 1e-11);
        }
    }

    #[test]
    fn bad_templates_are_refused() {
        let mesh = icosphere(0);
        let mut x = mesh.vertices.clone();
        assert!(matches!(
            GradientReconstruction::new(&mesh.topology, &x[1..]),
            Err(SolveError::Size { wanted: 12, found: 11, .. })
        ));
        x[3].y = f64::NAN;
        assert!(matches!(GradientReconstruction::new(&mesh.topology, &x), Err(SolveError::NotFinite { index: 3, .. })));
    }

    proptest! {
        #[test]
        fn every_affine_map_comes_back(entries in prop::array::uniform9(-2.0f64..2.0)) {
            let mesh = icosphere(1);
            let affine = Mat3::from_cols_array(&entries);
            let target: Vec<Vec3> = mesh.vertices.iter().map(|&p| affine * p).collect();
            let gradients = deformation_gradients(&mesh.topology, &mesh.vertices, &target);
            let mut out = vec![Vec3::ZERO; target.len()];
            GradientReconstruction::new(&mesh.topology, &mesh.vertices).unwrap().reconstruct(&gradients, &mut out);
            prop_assert!(largest_distance(&out, &centred(&target)) < 1e-12);
        }
    }
}

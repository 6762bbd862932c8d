//! Shape and pose of a body from its vertices: the inverse of [`Body::pose`], for bodies of this model that other programs
//! moved or wrote down.

use modiste_core::{Matrix, Quat, Vec3, align_rigid, centroid, solve_spd, vector_from_rotation};

use crate::{Body, BodyError, Part, Pose, ScapeModel};

/// Most rounds in which the parts are turned onto their vertices.
const MOST_ROUNDS: usize = 60;

/// Turns (rad) and shifts (m) below this end the search.
const SETTLED: f64 = 1e-7;

/// How far each turn goes beyond the one found: vertices between two parts follow either only in part, so that the rotation
/// that fits them best falls short of what is missing.
const REACH: f64 = 1.15;

/// Noise of a coordinate (m) in files of single precision and six decimals: coefficients that move the body by less are not told
/// by its vertices and stay small.
const NOISE: f64 = 1e-6;

/// A shape that was found.
#[derive(Debug, Clone, PartialEq)]
pub struct RecoveredShape {
    /// β in standard deviations, all coefficients of the model.
    pub shape: Vec<f64>,
    /// Where the vertices lie against [`Body::rest_vertices`] of that shape (m).
    pub translation: Vec3,
    /// Root of the mean squared distance of the vertices (m) from that body.
    pub rms: f64,
}

/// A pose that was found.
#[derive(Debug, Clone, PartialEq)]
pub struct RecoveredPose {
    /// The pose.
    pub pose: Pose,
    /// Root of the mean squared distance of the vertices (m) from the body in that pose.
    pub rms: f64,
}

/// Finds shapes of a model; the normal equations are set up once.
#[derive(Debug)]
pub struct ShapeFinder<'a> {
    model: &'a ScapeModel,
    /// Directions about their means, which a free translation takes out.
    directions: Vec<Vec<Vec3>>,
    normal_matrix: Matrix,
}

impl<'a> ShapeFinder<'a> {
    /// Prepares a model.
    pub fn new(model: &'a ScapeModel) -> Self {
        let centred = |direction: &Vec<Vec3>| {
            let middle = centroid(direction);
            direction.iter().map(|d| *d - middle).collect::<Vec<Vec3>>()
        };
        let directions: Vec<Vec<Vec3>> = model.shape_directions().iter().map(centred).collect();
        let dot = |a: &[Vec3], b: &[Vec3]| a.iter().zip(b).map(|(a, b)| a.dot(*b)).sum::<f64>();
        let count = directions.len();
        let prior = |i, j| if i == j { NOISE * NOISE } else { 0.0 };
        let normal_matrix = Matrix::from_fn(count, count, |i, j| dot(&directions[i], &directions[j]) + prior(i, j));
        Self { model, directions, normal_matrix }
    }

    /// The shape whose body in the template pose lies nearest to `vertices` (m), wherever they stand: `|X + Σ β_k d_k + t - v|²`
    /// is least, with the prior `NOISE² |β|²`. It is exact for a body of the model, because the template pose is linear in β.
    ///
    /// # Errors
    /// Another number of vertices, or coefficients that no body has.
    pub fn find(&self, vertices: &[Vec3]) -> Result<RecoveredShape, BodyError> {
        let template = self.model.template();
        check_count(vertices, template.len())?;
        let difference: Vec<Vec3> = vertices.iter().zip(template).map(|(v, x)| *v - *x).collect();
        let right = Matrix::from_fn(self.directions.len(), 1, |k, _| {
            self.directions[k].iter().zip(&difference).map(|(d, v)| d.dot(*v)).sum()
        });
        let shape = solve_spd(&self.normal_matrix, &right)?.column(0);
        let mut residual = difference;
        for (direction, beta) in self.directions.iter().zip(&shape) {
            residual.iter_mut().zip(direction).for_each(|(r, d)| *r -= *beta * *d);
        }
        let middle = centroid(&residual);
        let squared: f64 = residual.iter().map(|r| r.distance_squared(middle)).sum();
        // The model stands its bodies on the floor, below the pelvis; the directions know nothing of that.
        let translation = centroid(vertices) - centroid(template) - self.standing_offset(&shape);
        Ok(RecoveredShape { shape, translation, rms: (squared / vertices.len().max(1) as f64).sqrt() })
    }

    /// From the centroid of the template to that of the standing body (m).
    fn standing_offset(&self, shape: &[f64]) -> Vec3 {
        let template = self.model.template();
        let mut x = template.to_vec();
        for (direction, beta) in self.model.shape_directions().iter().zip(shape) {
            x.iter_mut().zip(direction).for_each(|(x, d)| *x += *beta * *d);
        }
        let pelvis = self.model.regress_joints(&x)[Part::Pelvis.index()];
        let floor = x.iter().map(|x| x.y).fold(f64::INFINITY, f64::min);
        let moved = Vec3::new(-pelvis.x, -floor, -pelvis.z);
        centroid(&x) - centroid(template) + moved
    }
}

/// Finds poses of a body; what does not change from frame to frame is set up once.
#[derive(Debug)]
pub struct PoseFinder<'a> {
    body: &'a Body,
    part_vertices: [Vec<usize>; Part::COUNT],
}

impl<'a> PoseFinder<'a> {
    /// Prepares a body.
    pub fn new(body: &'a Body) -> Self {
        let mut part_vertices: [Vec<usize>; Part::COUNT] = Default::default();
        for (vertex, part) in body.model().vertex_parts().iter().enumerate() {
            part_vertices[part.index()].push(vertex);
        }
        Self { body, part_vertices }
    }

    /// The pose in which the body lies nearest to `vertices` (m), searched from `start` or from the parts one by one.
    ///
    /// Every part is turned by the rotation that takes its vertices in the last pose to those wanted, and the pelvis shifted,
    /// until nothing moves. For vertices that a body of this model posed, the pose comes back.
    ///
    /// # Errors
    /// Another number of vertices.
    pub fn find(&self, vertices: &[Vec3], start: Option<&Pose>) -> Result<RecoveredPose, BodyError> {
        check_count(vertices, self.body.rest_vertices().len())?;
        let mut posed = self.body.rest_vertices().to_vec();
        let mut free = posed.clone();
        let (mut world, mut root) = match start {
            Some(pose) => {
                self.body.pose(pose, &mut posed);
                self.body.pose_without_contact(pose, &mut free);
                (pose.world_quaternions(), pose.root_translation)
            }
            None => ([Quat::IDENTITY; Part::COUNT], self.body.template_pose().root_translation),
        };
        for round in 0..MOST_ROUNDS {
            // Parts move far at first; from then on only what is missing counts.
            let reach = if round == 0 && start.is_none() { 1.0 } else { REACH };
            let moved = self.turn((&free, &posed), vertices, reach, &mut world, &mut root);
            let pose = Pose::from_world_rotations(root, &world);
            self.body.pose(&pose, &mut posed);
            self.body.pose_without_contact(&pose, &mut free);
            if moved < SETTLED {
                break;
            }
        }
        let squared: f64 = posed.iter().zip(vertices).map(|(x, v)| x.distance_squared(*v)).sum();
        let rms = (squared / vertices.len().max(1) as f64).sqrt();
        Ok(RecoveredPose { pose: Pose::from_world_rotations(root, &world), rms })
    }

    /// Turns every part, shifts the pelvis, and says how far the farthest went (rad or m). Skin that gave way to other skin
    /// tells nothing of where its part is: where the posed body is not as its model alone has it.
    fn turn(
        &self,
        (free, posed): (&[Vec3], &[Vec3]),
        wanted: &[Vec3],
        reach: f64,
        world: &mut [Quat; Part::COUNT],
        root: &mut Vec3,
    ) -> f64 {
        let mut moved: f64 = 0.0;
        let mut turns = [Quat::IDENTITY; Part::COUNT];
        for part in Part::ALL {
            let own = &self.part_vertices[part.index()];
            let untouched: Vec<usize> = own.iter().copied().filter(|&v| free[v] == posed[v]).collect();
            let own = if untouched.len() < 3 { own } else { &untouched };
            let of = |points: &[Vec3]| own.iter().map(|&v| points[v]).collect::<Vec<Vec3>>();
            let turn = if own.len() < 3 {
                // A part without vertices goes with its parent.
                part.parent().map_or(Quat::IDENTITY, |parent| turns[parent.index()])
            } else {
                let (rotation, shift) = align_rigid(&of(free), &of(wanted));
                if part == Part::Pelvis {
                    let step = rotation * *root + shift - *root;
                    moved = moved.max(step.length());
                    *root += step;
                }
                Quat::from_scaled_axis(reach * vector_from_rotation(rotation))
            };
            moved = moved.max(turn.to_scaled_axis().length());
            turns[part.index()] = turn;
            world[part.index()] = (turn * world[part.index()]).normalize();
        }
        moved
    }
}

fn check_count(vertices: &[Vec3], wanted: usize) -> Result<(), BodyError> {
    if vertices.len() == wanted {
        return Ok(());
    }
    Err(BodyError::Size { what: "vertices of the body", wanted: wanted.to_string(), found: vertices.len() })
}

#[cfg(test)]
mod tests {
    use modiste_core::Vec3;

    use super::{PoseFinder, ShapeFinder};
    use crate::scape::synthetic;
    use crate::{Part, Pose};

    #[test]
    fn a_shape_comes_back_from_its_body_wherever_it_stands() {
        let model = synthetic::model();
        let body = model.body(&[1.3, -0.4, 0.8]).unwrap();
        let shift = Vec3::new(0.3, -0.2, 5.0);
        let moved: Vec<Vec3> = body.rest_vertices().iter().map(|x| *x + shift).collect();
        let found = ShapeFinder::new(&model).find(&moved).unwrap();
        // Tubes have two measures; the third coefficient of their model does next to nothing.
        assert!(found.shape.iter().zip(body.shape()).take(2).all(|(a, b)| (a - b).abs() < 1e-2), "{found:?}");
        assert!(found.rms < 1e-6, "{}", found.rms);
        assert!(found.translation.distance(shift) < 1e-5, "{}", found.translation);
        assert!(ShapeFinder::new(&model).find(&moved[1..]).unwrap_err().to_string().contains("vertices of the body"));
    }

    #[test]
    fn a_body_that_is_bent_is_none_in_the_template_pose() {
        let model = synthetic::model();
        let body = model.body(&[]).unwrap();
        let mut pose = body.template_pose();
        pose.rotations[Part::LeftForearm.index()] = Vec3::new(0.0, -0.9, 0.0);
        let mut posed = Vec::new();
        body.pose(&pose, &mut posed);
        assert!(ShapeFinder::new(&model).find(&posed).unwrap().rms > 0.01);
    }

    #[test]
    fn a_pose_comes_back_from_its_vertices() {
        let body = synthetic::model().body(&[0.5]).unwrap();
        let finder = PoseFinder::new(&body);
        let mut last: Option<Pose> = None;
        for frame in 0..4 {
            let bend = 0.3 * f64::from(frame);
            let mut pose = Pose::template(Vec3::new(0.1, 1.0 + bend, -0.3));
            pose.rotations[Part::Pelvis.index()] = Vec3::new(0.2, 2.5 * bend, 0.0);
            pose.rotations[Part::LeftUpperArm.index()] = Vec3::new(0.0, 0.4 + bend, -0.3);
            pose.rotations[Part::LeftForearm.index()] = Vec3::new(0.1, -bend, 0.0);
            let mut posed = Vec::new();
            body.pose(&pose, &mut posed);
            let found = finder.find(&posed, last.as_ref()).unwrap();
            assert!(found.rms < 2e-6, "frame {frame}: {}", found.rms);
            assert!(found.pose.root_translation.distance(pose.root_translation) < 1e-5);
            let (wanted, got) = (pose.world_quaternions(), found.pose.world_quaternions());
            for part in [Part::Pelvis, Part::Chest, Part::LeftUpperArm, Part::LeftForearm, Part::LeftHand] {
                let angle = wanted[part.index()].angle_between(got[part.index()]);
                assert!(angle < 1e-4, "frame {frame}, {}: {angle}", part.name());
            }
            last = Some(found.pose);
        }
    }
}

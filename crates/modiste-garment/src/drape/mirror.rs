//! A garment in motion as it is seen in a mirror: what it does on one side it can do on the other.

use modiste_core::{TriangleBvh, Vec3};

use super::training_set::{Garment, PoseSequence};
use crate::refine::anchors::offset;

/// The place of every vertex's mirror image on the garment, in the template pose.
///
/// Garments are sewn alike left and right and the mean body is, but for its triangles; so a motion seen in the mirror is one
/// that the garment could do, and need not be simulated.
#[derive(Debug, Clone)]
pub(crate) struct Mirror {
    places: Vec<([u32; 3], [f64; 3])>,
}

/// The mirror image of a template vertex is looked for within this (m).
const REACH: f64 = 0.1;

/// Mirror images farther from the garment than this (m), in the mean, show that left and right differ.
const ALIKE: f64 = 0.004;

impl Mirror {
    /// For this garment; `None` if its left and its right are cut differently.
    pub(crate) fn new(garment: &Garment) -> Option<Self> {
        let tree = TriangleBvh::new(&garment.topology, &garment.template);
        let found: Vec<_> = garment
            .template
            .iter()
            .map(|&vertex| tree.closest_point(&garment.template, reflected(vertex), REACH))
            .collect::<Option<_>>()?;
        let mean = found.iter().map(|place| place.distance).sum::<f64>() / found.len().max(1) as f64;
        let faces = garment.topology.faces();
        let place = |place: modiste_core::SurfacePoint| (faces[place.face as usize], place.barycentric);
        (mean < ALIKE).then(|| Self { places: found.into_iter().map(place).collect() })
    }

    /// The sequence in the mirror. It keeps its name: what is held out with it must not be learned from.
    pub(crate) fn sequence(&self, garment: &Garment, sequence: &PoseSequence) -> PoseSequence {
        let frames: Vec<Vec<Vec3>> = sequence.frames.iter().map(|vertices| self.vertices(vertices)).collect();
        // The anchors lie as far from their places as in the sequence, on the other side.
        let anchors = frames.iter().zip(sequence.frames.iter().zip(&sequence.body_anchors));
        let body_anchors = anchors
            .map(|(mirrored, (vertices, places))| {
                let offset = reflected(offset(&garment.anchors, vertices, places));
                garment.anchors.iter().map(|&[vertex, _]| mirrored[vertex as usize] - offset).collect()
            })
            .collect();
        PoseSequence { name: sequence.name.clone(), motion: sequence.motion.mirrored(), frames, body_anchors }
    }

    fn vertices(&self, vertices: &[Vec3]) -> Vec<Vec3> {
        let at = |(face, weights): &([u32; 3], [f64; 3])| {
            reflected((0..3).map(|corner| weights[corner] * vertices[face[corner] as usize]).sum())
        };
        self.places.iter().map(at).collect()
    }
}

fn reflected(x: Vec3) -> Vec3 {
    Vec3::new(-x.x, x.y, x.z)
}

#[cfg(test)]
mod tests {
    use super::{Mirror, reflected};
    use crate::drape::synthetic::training_set;
    use modiste_core::Vec3;

    #[test]
    fn the_mirror_image_of_a_mirror_image_is_the_thing_itself() {
        let set = training_set();
        let (garment, sequence) = (&set.garment, &set.sequences[0]);
        let mirror = Mirror::new(garment).unwrap();
        let image = mirror.sequence(garment, sequence);
        assert_eq!((&image.name, image.frames.len()), (&sequence.name, sequence.frames.len()));
        assert!(image.motion.frames[9].root_translation.x + sequence.motion.frames[9].root_translation.x == 0.0);
        // The tube is cut alike left and right: vertex for vertex.
        let ring = |x: &[Vec3], side: usize| x[side];
        let at = 20;
        assert!(ring(&image.frames[at], 3).distance(reflected(ring(&sequence.frames[at], 13))) < 1e-9);
        let again = mirror.sequence(garment, &image);
        for (a, b) in again.frames[at].iter().zip(&sequence.frames[at]) {
            assert!(a.distance(*b) < 1e-9);
        }
        let offset = |of: &crate::drape::PoseSequence| {
            crate::refine::anchors::offset(&garment.anchors, &of.frames[at], &of.body_anchors[at])
        };
        assert!(offset(&image).distance(reflected(offset(sequence))) < 1e-12);
    }

    #[test]
    fn a_garment_whose_sides_differ_has_no_mirror_image() {
        let mut garment = training_set().garment;
        garment.template.iter_mut().filter(|x| x.x > 0.0).for_each(|x| x.x *= 1.5);
        assert!(Mirror::new(&garment).is_none());
    }
}

//! Grooming: guides grown over the head and combed into a style.

use modiste_body::Body;
use modiste_core::{Rng, Vec3, normal, seeded_rng};
use serde::{Deserialize, Serialize};

use crate::scalp::{Root, elevation, skull_middle, spread_roots};
use crate::surface::{Bust, Surface};
use crate::{Guides, HairError, POINTS};

/// How hair is cut and combed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Style {
    /// A few centimetres all over.
    Short,
    /// Parted in the middle, to chin or shoulders.
    Bob,
    /// Parted in the middle, over the shoulders and down the back.
    Long,
    /// Combed back from the forehead.
    Swept,
}

/// How a style is grown.
struct Recipe {
    /// Length (m) at length factor 0 and 1.
    lengths: [f64; 2],
    /// How far hair stands off the scalp at its root, as a part of its direction.
    lift: f64,
    /// How much of its direction hair keeps from point to point, up to 1.
    stiffness: f64,
    /// How much it is drawn along the comb while it is young.
    comb: f64,
    /// How much it falls.
    fall: f64,
    /// How thick the hair lies on the head under the topmost strands (m).
    thickness: f64,
    /// How much directions scatter.
    scatter: f64,
}

/// Smallest distance of hair from the skin (m).
pub const CLEARANCE: f64 = 0.0025;
/// How far the surface is looked for while hair is grown (m).
const REACH: f64 = 0.08;
/// Steps of growth per segment of a guide.
const STEPS: usize = 4;

impl Style {
    /// All styles.
    pub const ALL: [Self; 4] = [Self::Short, Self::Bob, Self::Long, Self::Swept];

    /// Name on the command line and in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Short => "short",
            Self::Bob => "bob",
            Self::Long => "long",
            Self::Swept => "swept",
        }
    }

    /// The style of this name, if there is one.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|style| style.name() == name)
    }

    /// Length of the hair (m) at length factor 0 and 1.
    pub fn lengths(self) -> [f64; 2] {
        self.recipe().lengths
    }

    fn recipe(self) -> Recipe {
        match self {
            Self::Short => Recipe {
                lengths: [0.03, 0.075],
                lift: 0.75,
                stiffness: 0.86,
                comb: 0.25,
                fall: 0.08,
                thickness: 0.008,
                scatter: 0.06,
            },
            Self::Bob => Recipe {
                lengths: [0.14, 0.24],
                lift: 0.3,
                stiffness: 0.78,
                comb: 0.16,
                fall: 0.16,
                thickness: 0.013,
                scatter: 0.025,
            },
            Self::Long => Recipe {
                lengths: [0.18, 0.40],
                lift: 0.3,
                stiffness: 0.78,
                comb: 0.16,
                fall: 0.16,
                thickness: 0.014,
                scatter: 0.025,
            },
            Self::Swept => Recipe {
                lengths: [0.10, 0.24],
                lift: 0.3,
                stiffness: 0.80,
                comb: 0.22,
                fall: 0.16,
                thickness: 0.014,
                scatter: 0.03,
            },
        }
    }

    /// The way the comb goes at a place on the head, seen from the middle of the skull; not of unit length.
    fn comb(self, from_middle: Vec3) -> Vec3 {
        let side = if from_middle.x >= 0.0 { 1.0 } else { -1.0 };
        match self {
            // Away from a whorl at the back of the crown.
            Self::Short => {
                let whorl = Vec3::new(0.01, 0.085, -0.055);
                from_middle - whorl
            }
            // Off the parting, and back from the face.
            Self::Bob | Self::Long => {
                let front = ((from_middle.z + 0.02) / 0.08).clamp(0.0, 1.0);
                let back = (-from_middle.z / 0.06).clamp(0.0, 1.0);
                Vec3::new(side * (0.85 - 0.1 * front - 0.55 * back), -0.35, -0.3 - 0.75 * front)
            }
            Self::Swept => Vec3::new(side * 0.12, 0.05, -1.0),
        }
    }
}

/// A groom: guides on a body in the template pose.
#[derive(Debug, Clone, PartialEq)]
pub struct Groom {
    /// Where each guide is rooted.
    pub roots: Vec<Root>,
    /// The guides (m).
    pub guides: Guides,
    /// How far above the skin each guide lies at least (m): upper layers lie on lower ones.
    pub clearances: Vec<f64>,
}

impl Groom {
    /// Grows `count` guides of a style; `length` is the length factor, 0 to 1.
    ///
    /// Roots, clearances and scatter depend on the seed alone, so that guides of different lengths correspond.
    ///
    /// # Errors
    /// As [`spread_roots`]; also a length factor outside 0 to 1.
    pub fn grow(body: &Body, style: Style, length: f64, count: usize, seed: u64) -> Result<Self, HairError> {
        crate::error::check_range("length of the groom", length, 0.0, 1.0)?;
        let roots = spread_roots(body, count, seed)?;
        let recipe = style.recipe();
        let metres = recipe.lengths[0] + length * (recipe.lengths[1] - recipe.lengths[0]);
        let surface = Bust::new(body.model())?.surface(body.rest_vertices());
        let middle = skull_middle(body);
        let mut rng = seeded_rng(seed ^ 0x6861_6972);
        let mut points = Vec::with_capacity(count * POINTS);
        let mut clearances = Vec::with_capacity(count);
        for root in &roots {
            let start = root.position(body.model().topology(), body.rest_vertices());
            let layer = layer(start - middle);
            let clearance = CLEARANCE + recipe.thickness * layer;
            let scatter = [(); 2].map(|()| random_vector(&mut rng));
            let metres = metres * (1.0 + 0.04 * scatter[1].x).clamp(0.85, 1.15);
            let out = root.frame(body.model().topology(), body.rest_vertices()).z_axis;
            let strand = Strand { style, recipe: &recipe, surface: &surface, middle, scatter, clearance };
            points.extend(strand.grow(start, out, metres));
            clearances.push(clearance);
        }
        Ok(Self { roots, guides: Guides { points }, clearances })
    }
}

/// 0 for the lowest roots, 1 for those at the crown.
pub(crate) fn layer(from_middle: Vec3) -> f64 {
    ((elevation(from_middle) + 30.0) / 110.0).clamp(0.0, 1.0)
}

fn random_vector(rng: &mut Rng) -> Vec3 {
    Vec3::new(normal(rng), normal(rng), normal(rng))
}

/// One strand while it grows.
struct Strand<'a> {
    style: Style,
    recipe: &'a Recipe,
    surface: &'a Surface,
    middle: Vec3,
    scatter: [Vec3; 2],
    clearance: f64,
}

impl Strand<'_> {
    fn grow(&self, root: Vec3, out: Vec3, metres: f64) -> Vec<Vec3> {
        let recipe = self.recipe;
        let count = (POINTS - 1) * STEPS;
        let step = metres / count as f64;
        let comb = |p: Vec3| {
            let comb = self.style.comb(p - self.middle);
            comb.reject_from_normalized(out).normalize_or_zero()
        };
        let mut direction = (comb(root) + recipe.lift * out + recipe.scatter * self.scatter[0]).normalize_or(out);
        let mut curve = vec![root];
        let mut p = root;
        for index in 0..count {
            let along = (index + 1) as f64 * step;
            // The comb lets go after a hand's breadth.
            let held = (1.0 - along / 0.16).max(0.0);
            direction = (recipe.stiffness.powf(step / 0.01) * direction
                + (step / 0.01) * (recipe.comb * held * comb(p) + recipe.fall * Vec3::NEG_Y))
                .normalize_or(direction);
            let clearance = self.clearance.min(CLEARANCE + 0.5 * along);
            let mut next = p + step * direction;
            for _ in 0..2 {
                let free = self.surface.pushed_out(next, clearance, REACH);
                next = p + step * (free - p).normalize_or(direction);
            }
            direction = (next - p).normalize_or(direction);
            p = next;
            curve.push(p);
        }
        crate::guides::resample(&curve, POINTS)
    }
}

//! Whether a crowd costs as much as its members.

use std::sync::Arc;
use std::time::Instant;

use anyhow::{Context, Result, ensure};
use modiste_core::{normal, seeded_rng};
use modiste_garment::refine::FitOptions;
use modiste_scene::{Dresser, Memory, Person};
use serde::Serialize;

use super::{walk, wardrobe};
use crate::report::page::{Page, rounded};

/// People in the crowd.
const COUNT: usize = 200;
/// Frames of everybody.
const FRAMES: usize = 20;
/// People who are timed alone.
const ALONE: usize = 10;

/// What a crowd takes.
#[derive(Debug, Serialize)]
struct Crowd {
    people: usize,
    frame_ms_in_crowd: f64,
    frame_ms_alone: f64,
    mb_per_person: f64,
}

pub(crate) fn measure() -> Result<Page> {
    let mut page = Page::new("Crowds");
    page.paragraph(format!(
        "{COUNT} women of random shapes in the same shorts and T-shirt, all of them frame after frame, {FRAMES} frames: how long \
         one of them takes for a frame on one core, beside {ALONE} of them one after the other. Models are shared; the memory is \
         what each further person adds."
    ));
    let (model, garments) = wardrobe(&["shorts", "tshirt"])?;
    let garments: Vec<_> = garments.into_iter().map(Arc::new).collect();
    let mut rng = seeded_rng(200);
    let mut people = Vec::with_capacity(COUNT);
    let mut before = None;
    for index in 0..COUNT {
        let shape: Vec<f64> = (0..model.shape_count()).map(|_| normal(&mut rng).clamp(-3.0, 3.0)).collect();
        let person = Person::new(model.body(&shape)?, garments.clone())?;
        let motion = walk(person.body(), person.fps())?;
        people.push((Dresser::new(&person, &FitOptions::default())?, motion));
        if index == 0 {
            before = Memory::now();
        }
    }
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build()?;
    let alone = pool.install(|| {
        let started = Instant::now();
        for (dresser, motion) in people.iter_mut().take(ALONE) {
            dresser.restart();
            for pose in motion.frames.iter().cycle().take(FRAMES) {
                dresser.step(pose);
            }
        }
        started.elapsed().as_secs_f64() / (ALONE * FRAMES) as f64
    });
    let together = pool.install(|| {
        people.iter_mut().for_each(|(dresser, _)| dresser.restart());
        let started = Instant::now();
        for frame in 0..FRAMES {
            for (dresser, motion) in &mut people {
                dresser.step(&motion.frames[frame % motion.frames.len()]);
            }
        }
        started.elapsed().as_secs_f64() / (COUNT * FRAMES) as f64
    });
    let (before, after) = before.zip(Memory::now()).context("the system does not say how much memory is used")?;
    ensure!(alone > 0.0, "nothing was timed");
    let found = Crowd {
        people: COUNT,
        frame_ms_in_crowd: 1e3 * together,
        frame_ms_alone: 1e3 * alone,
        mb_per_person: (after.resident_mb - before.resident_mb) / (COUNT - 1) as f64,
    };
    let cells = [found.frame_ms_in_crowd, found.frame_ms_alone, found.mb_per_person].map(rounded);
    let row: Vec<String> = std::iter::once(COUNT.to_string()).chain(cells).collect();
    page.table(&["people", "frame in the crowd (ms)", "frame alone (ms)", "memory of a further person (MB)"], [row]);
    page.at_most("time of a crowd over that of its members alone", together / alone, 1.1, "");
    page.figures("crowd", &found)?;
    Ok(page)
}

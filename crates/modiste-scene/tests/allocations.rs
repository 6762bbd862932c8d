//! A frame asks the system for no memory once a character has moved for a while.
#![allow(unsafe_code, reason = "an allocator that counts is one")]
#![expect(clippy::unwrap_used, reason = "a test stops where something is missing")]

use std::alloc::{GlobalAlloc, Layout, System};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use modiste_body::motion::{generate, resample};
use modiste_body::{Motion, ScapeModel};
use modiste_garment::DrapeModel;
use modiste_garment::refine::FitOptions;
use modiste_scene::{Dresser, Person};

struct Counting;

static COUNT: AtomicUsize = AtomicUsize::new(0);

// SAFETY: all is passed on to the system's allocator.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        COUNT.fetch_add(1, Ordering::Relaxed);
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, place: *mut u8, layout: Layout) {
        unsafe { System.dealloc(place, layout) }
    }

    unsafe fn realloc(&self, place: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        COUNT.fetch_add(1, Ordering::Relaxed);
        unsafe { System.realloc(place, layout, size) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

fn dresser() -> (Dresser, Motion) {
    let assets = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets");
    let model = ScapeModel::load(assets.join("body-female.safetensors")).unwrap();
    let garments = ["shorts", "tshirt"]
        .map(|name| Arc::new(DrapeModel::load(assets.join(format!("female-{name}.safetensors"))).unwrap()));
    let person = Person::new(model.body(&[0.5, -1.0]).unwrap(), garments.to_vec()).unwrap();
    let motion = resample(&generate::walk(person.body(), 2.0).unwrap(), person.fps());
    (Dresser::new(&person, &FitOptions::default()).unwrap(), motion)
}

#[test]
fn a_frame_allocates_nothing_after_the_warm_up() {
    let (mut dresser, motion) = dresser();
    for threads in [1, 2] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let allocated = pool.install(|| {
            let mut last = 0;
            // Lists grow to what the motion asks for. Nothing is the same the first time, as there was nothing before.
            for _ in 0..7 {
                let before = COUNT.load(Ordering::Relaxed);
                for pose in &motion.frames {
                    dresser.step(pose);
                }
                last = COUNT.load(Ordering::Relaxed) - before;
            }
            last
        });
        assert_eq!(allocated, 0, "in {} frames on {threads} threads", motion.frames.len());
    }
}

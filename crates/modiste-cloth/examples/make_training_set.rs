//! Makes a training set:
//! `cargo run --release -p modiste-cloth --example make_training_set -- BODY.safetensors GARMENT FOLDER [MOCAP] [BODIES]`.

use std::error::Error;
use std::path::Path;
use std::time::Instant;

use modiste_body::ScapeModel;
use modiste_cloth::training_set::{TrainingOptions, generate, training_sequences};
use modiste_core::Progress;

/// Prints a line for every tenth of a stage.
#[derive(Debug)]
struct Lines(std::sync::Mutex<(usize, Instant)>);

impl Progress for Lines {
    fn start(&self, stage: &str, total: usize) {
        if let Ok(mut state) = self.0.lock() {
            *state = (total, Instant::now());
        }
        eprintln!("{stage}: {total}");
    }

    fn advance(&self, stage: &str, done: usize) {
        if let Ok(state) = self.0.lock() {
            if done % (state.0 / 10).max(1) == 0 {
                eprintln!("{stage}: {done} of {}, {:.0} s", state.0, state.1.elapsed().as_secs_f64());
            }
        }
    }

    fn warn(&self, message: &str) {
        eprintln!("{message}");
    }

    fn finish(&self, stage: &str) {
        eprintln!("{stage}: finished");
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [model, garment, folder, rest @ ..] = &arguments[..] else {
        return Err("body model, garment and folder are wanted".into());
    };
    let progress = Lines(std::sync::Mutex::new((0, Instant::now())));
    let model = ScapeModel::load(model)?;
    let mocap = rest.first().map(Path::new);
    let sequences = training_sequences(&model.body(&[])?, mocap, &progress)?;
    let mut options = TrainingOptions::new(garment);
    if let Some(count) = rest.get(1) {
        options.body_count = count.parse()?;
    }
    let summary = generate(&model, &sequences, &options, Path::new(folder), &progress)?;
    println!("{summary:#?}");
    Ok(())
}

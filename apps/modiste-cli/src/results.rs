//! Results in words.

use std::fmt::Write;

use modiste::{Dressed, EvaluatedGarment, MadePopulation, Outcome, SimulatedGarment};

/// What a person reads at the end.
pub(crate) fn text(outcome: &Outcome) -> String {
    match outcome {
        Outcome::Dressed(dressed) => dressed_text(dressed),
        Outcome::MadeBody(made) => {
            let shape: Vec<String> = made.shape.iter().map(|value| format!("{value:.3}")).collect();
            format!("{}\n\nshape {}\nwrote {}", made.measurements, shape.join(","), made.file.display())
        }
        Outcome::MeasuredBody(measured) => measured.measurements.to_string(),
        Outcome::MadePopulation(made) => population_text(made),
        Outcome::TrainedBody(trained) => format!(
            "learned from {} bodies\nwrote {} ({:.1} MB)",
            trained.bodies,
            trained.file.display(),
            trained.bytes as f64 / 1e6
        ),
        Outcome::SimulatedGarment(made) => simulated_text(made),
        Outcome::LearnedGarment(learned) | Outcome::ImportedGarment(learned) => format!(
            "{}\n{}\nwrote {}",
            simulated_text(&learned.simulated),
            evaluated_text(&learned.evaluated),
            learned.file.display()
        ),
        Outcome::EvaluatedGarment(evaluated) => evaluated_text(evaluated),
        Outcome::TrainedGarment(trained) => format!(
            "learned from {} bodies and {} frames, spectral radius of the dynamics {:.4}\nwrote {} ({:.1} MB)",
            trained.shapes,
            trained.frames,
            trained.spectral_radius,
            trained.file.display(),
            trained.bytes as f64 / 1e6
        ),
    }
}

fn simulated_text(made: &SimulatedGarment) -> String {
    let mut text = format!("{} bodies, {} motions of {} frames", made.bodies, made.sequences, made.frames);
    for dropped in &made.dropped {
        let _always_ok = write!(text, "\nleft out {dropped}");
    }
    let _always_ok = write!(text, "\nwrote {}", made.folder.display());
    text
}

fn evaluated_text(made: &EvaluatedGarment) -> String {
    let evaluation = &made.evaluation;
    let mut text = format!("{}, {:.1} MB", made.garment, made.bytes as f64 / 1e6);
    if let Some(shape) = &evaluation.shape
        && let (Some(count), Some(error)) = (shape.body_counts.last(), shape.mean_error.last())
    {
        let _always_ok = write!(
            text,
            "\nshape on bodies left out: {:.1} mm at {count} body coefficients (mean garment {:.1} mm)",
            1e3 * error,
            1e3 * shape.mean_garment_error
        );
    }
    let _always_ok = write!(
        text,
        "\nwrinkles: {} coefficients, {:.0} % of the variance, spectral radius {:.4}",
        evaluation.wrinkle_count,
        100.0 * evaluation.wrinkle_variance,
        evaluation.spectral_radius
    );
    if made.mean_body.frames + made.other_bodies.frames > 0 {
        text += &motions_table(made);
    }
    for dropped in &evaluation.dropped {
        let _always_ok = write!(text, "\nleft out {dropped}");
    }
    text
}

/// Every motion against physics, and the means.
fn motions_table(made: &EvaluatedGarment) -> String {
    let mut text = String::new();
    let _always_ok = write!(
        text,
        "\n{:<24}{:>6}{:>8}{:>16}{:>12}{:>20}",
        "motion", "body", "frames", "dynamic (mm)", "static (mm)", "curvature ratio"
    );
    for motion in made.evaluation.mean_body.iter().chain(&made.evaluation.other_bodies) {
        let body = if motion.body == 0 { "mean".to_owned() } else { motion.body.to_string() };
        let _always_ok = write!(
            text,
            "\n{:<24}{body:>6}{:>8}{:>16.1}{:>12.1}{:>20.2}",
            motion.motion,
            motion.frames,
            1e3 * motion.error,
            1e3 * motion.static_error,
            motion.curvature[1] / motion.curvature[0].max(f64::MIN_POSITIVE)
        );
    }
    for (name, mean) in [("all, mean body", made.mean_body), ("all, other bodies", made.other_bodies)] {
        let _always_ok = write!(
            text,
            "\n{name:<30}{:>8}{:>16.1}{:>12.1}{:>20.2}",
            mean.frames,
            1e3 * mean.error,
            1e3 * mean.static_error,
            mean.curvature_ratio
        );
    }
    text
}

fn population_text(made: &MadePopulation) -> String {
    let mut text = String::new();
    for found in &made.report.populations {
        let counts = format!("{}: {} bodies, {} held out", found.gender.name(), found.count, found.held_out);
        let _always_ok = writeln!(text, "{counts}, {} of them cross themselves", found.self_intersecting);
        for q in &found.quantities {
            let errors = (100.0 * q.mean_error, 100.0 * q.std_dev_error);
            let title = q.quantity.title();
            let _always_ok =
                writeln!(text, "  {title:<36} mean off by {:.2}%, deviation by {:.1}%", errors.0, errors.1);
        }
    }
    let files: Vec<String> = made.files.iter().map(|file| format!("wrote {}", file.display())).collect();
    text + &files.join("\n")
}

fn dressed_text(dressed: &Dressed) -> String {
    let report = &dressed.report;
    let mut text = format!("{} frames at {} per second", report.frames, report.fps);
    if let Some(times) = &report.milliseconds_per_frame {
        // Writing to a string cannot fail.
        let _always_ok = write!(
            text,
            ", {:.1} ms each (body {:.1}, synthesis {:.1}, fit {:.1}; 95% below {:.1})",
            times.total.median, times.body.median, times.synthesis.median, times.fit.median, times.total.p95
        );
    }
    for fit in &report.penetration {
        let _always_ok = write!(
            text,
            "\n{}: vertices inside the body per frame {:.1} before the fit, {:.1} after; deepest {:.2} mm, {:.2} mm",
            fit.garment,
            fit.before.vertices_per_frame,
            fit.after.vertices_per_frame,
            fit.before.deepest_mm,
            fit.after.deepest_mm
        );
    }
    for file in &dressed.files {
        let _always_ok = write!(text, "\nwrote {}", file.display());
    }
    text
}

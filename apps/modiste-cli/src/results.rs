//! Results in words.

use std::fmt::Write;

use modiste::check::Finding;
use modiste::{
    BenchedDress, BenchedHair, Checked, Dressed, EvaluatedGarment, LearnedHair, MadeCrowd, MadePopulation, Outcome,
    Region, SimulatedGarment,
};

/// What a script reads at the end: the outcome under its name; of a benchmark the rows alone.
pub(crate) fn json(outcome: &Outcome) -> serde_json::Result<String> {
    match outcome {
        Outcome::BenchedDress(benched) => serde_json::to_string_pretty(&benched.rows),
        Outcome::BenchedHair(benched) => serde_json::to_string_pretty(&benched.rows),
        outcome => serde_json::to_string_pretty(outcome),
    }
}

fn bench_text(benched: &BenchedDress) -> String {
    let mut text = format!(
        "{}, ms a frame (median)\n{:<18}{:>9}{:>9}{:>8}{:>11}{:>8}{:>8}{:>8}{:>9}",
        benched.machine.processor,
        "outfit",
        "vertices",
        "threads",
        "body",
        "synthesis",
        "fit",
        "total",
        "95 %",
        "peak MB"
    );
    for row in &benched.rows {
        let _always_ok = write!(
            text,
            "\n{:<18}{:>9}{:>9}{:>8.1}{:>11.1}{:>8.1}{:>8.1}{:>8.1}{:>9.0}",
            row.outfit,
            row.vertices,
            row.threads,
            row.body_ms,
            row.synthesis_ms,
            row.fit_ms,
            row.total_ms_p50,
            row.total_ms_p95,
            row.peak_mb
        );
    }
    text
}

fn bench_hair_text(benched: &BenchedHair) -> String {
    let mut text = format!(
        "{}, ms a frame (median)\n{:>7}{:>9}{:>11}{:>11}{:>9}{:>8}{:>8}{:>9}{:>10}",
        benched.machine.processor,
        "guides",
        "threads",
        "synthesis",
        "collision",
        "points",
        "total",
        "95 %",
        "physics",
        "inside"
    );
    for row in &benched.rows {
        let _always_ok = write!(
            text,
            "\n{:>7}{:>9}{:>11.2}{:>11.2}{:>9.2}{:>8.2}{:>8.2}{:>9.1}{:>9.3}%",
            row.guides,
            row.threads,
            row.synthesis_ms,
            row.collision_ms,
            row.reconstruction_ms,
            row.total_ms_p50,
            row.total_ms_p95,
            row.physics_ms,
            100.0 * row.inside
        );
    }
    text
}

fn learned_hair_text(learned: &LearnedHair) -> String {
    let mut text = format!(
        "{}: {} guides from {} sequences of {} frames, {} coefficients ({:.1} % of the variance), largest eigenvalue {:.4}",
        learned.name,
        learned.guides,
        learned.sequences,
        learned.frames,
        learned.dimensions,
        100.0 * learned.energy,
        learned.lambda_max
    );
    for error in &learned.errors {
        let _always_ok =
            write!(text, "\n{:<12} error {:.2} cm, held out {:.2} cm", error.cell, error.training_cm, error.test_cm);
    }
    let _always_ok = write!(text, "\nwrote {} ({:.1} MB)", learned.file.display(), learned.bytes as f64 / 1e6);
    text
}

/// What a person reads at the end.
pub(crate) fn text(outcome: &Outcome) -> String {
    match outcome {
        Outcome::Dressed(dressed) => dressed_text(dressed),
        Outcome::BenchedDress(benched) => bench_text(benched),
        Outcome::Checked(checked) => checked_text(checked),
        Outcome::MadeCrowd(made) => crowd_text(made),
        Outcome::BenchedHair(benched) => bench_hair_text(benched),
        Outcome::LearnedHair(learned) => learned_hair_text(learned),
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
        Outcome::LearnedGarment(learned) => format!(
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

fn crowd_text(made: &MadeCrowd) -> String {
    let report = &made.report;
    let [all, first, second] = report.seconds_per_character;
    let mut text = format!(
        "{} people in {:.1} s by {} threads: {all:.2} s each on one ({first:.2} s in the first half, {second:.2} s in the second)",
        report.characters.len(),
        report.seconds,
        report.threads
    );
    if let (Some(models), Some(character), Some(peak)) = (report.models_mb, report.character_mb, report.peak_mb) {
        let _always_ok =
            write!(text, "\nmemory: {models:.0} MB of models, {character:.1} MB for each person, {peak:.0} MB at most");
    }
    for file in made.files.iter().filter(|file| file.extension().is_some()) {
        let _always_ok = write!(text, "\nwrote {}", file.display());
    }
    text
}

/// One line for each kind of finding.
fn checked_text(checked: &Checked) -> String {
    let report = &checked.report;
    let mut text = format!("{} frames of {}", report.frames, checked.file.display());
    let mut line = |what: String, unit: &str, finding: &Finding| {
        let _always_ok = write!(text, "\n{what}: {} {unit}", finding.count);
        if let Some(frame) = finding.worst_frame {
            let frames = finding.frame_count();
            let _always_ok = write!(text, " in {frames} frames, deepest {:.2} mm in frame {frame}", finding.worst_mm);
        }
        if !finding.too_deep.is_empty() {
            let _always_ok = write!(text, "; too deep in frames {}", runs(&finding.too_deep));
        }
    };
    for found in &report.garments {
        let name = &found.garment;
        line(format!("{name} inside the body"), "vertices", &found.inside_body);
        line(format!("{name} pinched between parts of the body"), "vertices", &found.pinched);
        line(format!("{name} crossing the body"), "pairs of triangles", &found.crossing_body);
        line(format!("{name} crossing itself"), "pairs of triangles", &found.crossing_itself);
    }
    for found in &report.layers {
        let pair = (&found.outer, &found.inner);
        line(format!("{} below {}", pair.0, pair.1), "vertices", &found.below);
        line(format!("{} crossing {}", pair.0, pair.1), "pairs of triangles", &found.crossing);
    }
    line("body in itself".to_owned(), "vertices", &report.body_in_itself);
    let limit = report.limits.crossing_mm;
    let verdict = if report.holds { "holds" } else { "does not hold" };
    let _always_ok = write!(
        text,
        "\nthe guarantee {verdict}: no vertex inside the body, nothing in the body or in a garment below by more than {limit} mm"
    );
    text
}

/// Runs of frames, the first few of them.
fn runs(runs: &[[usize; 2]]) -> String {
    const SHOWN: usize = 12;
    let name = |[first, last]: &[usize; 2]| if first == last { first.to_string() } else { format!("{first}-{last}") };
    let mut names: Vec<String> = runs.iter().take(SHOWN).map(name).collect();
    if runs.len() > SHOWN {
        names.push("…".to_owned());
    }
    names.join(", ")
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
    for fit in &report.fit_map {
        let name = |word: String| word.to_lowercase();
        let _always_ok = write!(
            text,
            "\n{} (size {}), {}: {}; {:.0} mm from the body (5% nearer than {:.0}), stretched {:.1}% (5% more than {:.1}%)",
            fit.garment,
            fit.size,
            if fit.region == Region::UpperArm { "upper arm".to_owned() } else { name(format!("{:?}", fit.region)) },
            name(format!("{:?}", fit.verdict)),
            fit.ease_mm,
            fit.ease_5_percent_mm,
            fit.strain_percent,
            fit.strain_95_percent
        );
    }
    for file in &dressed.files {
        let _always_ok = write!(text, "\nwrote {}", file.display());
    }
    text
}

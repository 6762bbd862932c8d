//! Makes the populations from a folder of public files: `population [count] [sources] [out]`.

use std::path::PathBuf;

use modiste_body::Gender;
use modiste_body::population::{PopulationOptions, PopulationReport, PopulationSources, make};
use modiste_core::Silent;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let count = arguments.next().map_or(Ok(1000), |count| count.parse())?;
    let sources = arguments.next().map_or_else(|| PathBuf::from("../shared/data/bodies"), PathBuf::from);
    let out = arguments.next().map_or_else(|| PathBuf::from("training"), PathBuf::from);
    let options = PopulationOptions { count, ..PopulationOptions::default() };
    let report = make(&PopulationSources::find(sources)?, &Gender::ALL, &options, out, &Silent)?;
    print(&report);
    Ok(())
}

#[expect(clippy::print_stdout, reason = "the figures are what this program is for")]
fn print(report: &PopulationReport) {
    if let Some(carried) = &report.carried {
        let (template, worst) = (1000.0 * carried.template_rms, 1000.0 * carried.worst_rms);
        println!("carried directions: {template:.2} mm RMS at the mean, at worst {worst:.2} mm at ±2");
    }
    for population in &report.populations {
        let (count, held) = (population.count, population.held_out);
        println!("\n{}: {count} bodies, {held} held out", population.gender.name());
        println!(
            "quantity              mean  (error)    SD  (error)   residual: bias     rms     p95   worst  twin rms"
        );
        for q in &population.quantities {
            println!(
                "{:18} {:7.3} {:6.2}% {:7.4} {:6.2}%  {:+13.4} {:7.4} {:7.4} {:7.4} {:8.4}",
                q.quantity.name(),
                q.mean,
                100.0 * q.mean_error,
                q.std_dev,
                100.0 * q.std_dev_error,
                q.residual.bias,
                q.residual.rms,
                q.residual.percentile_95,
                q.residual.worst,
                q.residual_without_soft.rms
            );
        }
        println!("worst correlation error {:.3}", population.worst_correlation_error);
        println!("self-intersecting {}, degenerate {}", population.self_intersecting, population.degenerate);
        println!("distance to the twins without soft directions {:.2} mm", 1000.0 * population.twin_distance);
        println!("soft coefficients, SD: {:.2?}", population.soft_std_devs);
    }
}

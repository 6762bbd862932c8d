//! How the cost of a frame grows with the vertices and with the garments.

use anyhow::Result;
use serde::Serialize;

use super::{time, wardrobe};
use crate::report::page::{Page, rounded};
use crate::report::plot::{Series, lines};

/// Vertices of shorts and T-shirt together.
const SIZES: [usize; 7] = [2_000, 4_000, 8_794, 16_000, 30_000, 45_000, 60_000];
/// Garments that are put on one after the other.
const WORN: [&str; 4] = ["shorts", "skirt", "tshirt", "longsleeve"];
/// Numbers of threads.
const THREADS: [usize; 2] = [1, 2];

/// What a frame takes.
#[derive(Debug, Serialize)]
struct Cost {
    garments: usize,
    vertices: usize,
    threads: usize,
    median_ms: f64,
    p95_ms: f64,
}

pub(crate) fn measure() -> Result<Page> {
    let mut page = Page::new("How the cost grows");
    page.paragraph(
        "Shorts and T-shirt with more and fewer vertices: the built-in garments subdivided, or with vertices left out. Then \
         one to four garments over each other as they are built in: shorts, skirt, T-shirt, long sleeves.",
    );
    let by_vertices = by_vertices()?;
    let by_garments = by_garments()?;
    for (costs, name, label) in
        [(&by_vertices, "cost-vertices", "vertices"), (&by_garments, "cost-garments", "garments")]
    {
        let row = |cost: &Cost| {
            let counts = [cost.garments, cost.vertices, cost.threads].map(|count| count.to_string());
            counts.into_iter().chain([cost.median_ms, cost.p95_ms].map(rounded)).collect::<Vec<_>>()
        };
        page.table(&["garments", "vertices", "threads", "median (ms)", "95 % below (ms)"], costs.iter().map(row));
        let series = THREADS.map(|threads| {
            let of = costs.iter().filter(|cost| cost.threads == threads);
            let at = |cost: &Cost| if label == "garments" { cost.garments } else { cost.vertices } as f64;
            Series::new(format!("{threads} thread(s)"), of.map(|cost| (at(cost), cost.median_ms)).collect())
        });
        page.plot(name, &format!("time of a frame against {label}"), lines([label, "frame (ms)"], &series, None)?);
    }
    let of_one = || by_vertices.iter().filter(|cost| cost.threads == 1);
    if let (Some(small), Some(large)) = (of_one().find(|cost| cost.vertices > 8_000), of_one().next_back()) {
        let power = (large.median_ms / small.median_ms).ln() / (large.vertices as f64 / small.vertices as f64).ln();
        page.at_most("power by which the time grows with the vertices, from 8,794 on", power, 1.0, "");
    }
    page.figures("vertices", &by_vertices)?;
    page.figures("garments", &by_garments)?;
    Ok(page)
}

fn by_vertices() -> Result<Vec<Cost>> {
    let mut costs = Vec::new();
    for size in SIZES {
        println!("  {size} vertices");
        let (model, garments) = wardrobe(&["shorts", "tshirt"])?;
        let built_in: usize = garments.iter().map(|garment| garment.garment().template.len()).sum();
        let resampled = || {
            let part = |count: usize| (size as f64 * count as f64 / built_in as f64).round() as usize;
            garments
                .iter()
                .map(|garment| Ok(garment.resampled(part(garment.garment().template.len()))?))
                .collect::<Result<Vec<_>>>()
        };
        let worn = resampled()?;
        for threads in THREADS {
            let summary = time(&model, worn.clone(), threads)?;
            let (median_ms, p95_ms) = (summary.median, summary.p95);
            costs.push(Cost { garments: 2, vertices: size, threads, median_ms, p95_ms });
        }
    }
    Ok(costs)
}

fn by_garments() -> Result<Vec<Cost>> {
    let mut costs = Vec::new();
    let (model, garments) = wardrobe(&WORN)?;
    for count in 1..=garments.len() {
        println!("  {count} garment(s)");
        let vertices = garments[..count].iter().map(|garment| garment.garment().template.len()).sum();
        for threads in THREADS {
            let summary = time(&model, garments[..count].to_vec(), threads)?;
            let (median_ms, p95_ms) = (summary.median, summary.p95);
            costs.push(Cost { garments: count, vertices, threads, median_ms, p95_ms });
        }
    }
    Ok(costs)
}

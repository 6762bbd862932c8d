use modiste_body::ScapeModel;
use modiste_hair::training::*;
use modiste_hair::*;
struct P;
impl modiste_core::Progress for P {
    fn start(&self, s: &str, n: usize) {
        println!("{s} {n}");
    }
    fn advance(&self, s: &str, n: usize) {
        println!("{s} {n}");
    }
    fn warn(&self, s: &str) {
        println!("{s}");
    }
    fn finish(&self, s: &str) {
        println!("{s} done");
    }
}
fn main() {
    let a: Vec<String> = std::env::args().collect();
    let model = ScapeModel::load("assets/body-female.safetensors").unwrap();
    let body = model.body(&[]).unwrap();
    let guides: usize = a[2].parse().unwrap();
    let style = Style::from_name(&a[1]).unwrap();
    let cells: Vec<Cell> = match a[3].as_str() {
        "styles" => Cell::STYLES.to_vec(),
        "all" => Cell::STYLES.into_iter().chain(Cell::WINDS).collect(),
        _ => vec![Cell::STYLES[0]],
    };
    let seqs = sequences(&body, Some("../shared/data/mocap".as_ref()), 1, &P).unwrap();
    let mut seqs = seqs;
    seqs.sort_by_key(|s| !s.held_out);
    println!(
        "{} sequences, {} frames, {} test frames",
        seqs.len(),
        seqs.iter().map(|s| s.motion.frames.len()).sum::<usize>(),
        seqs.iter().filter(|s| s.held_out).map(|s| s.motion.frames.len()).sum::<usize>()
    );
    let grooms: Vec<Groom> = cells.iter().map(|c| Groom::grow(&body, style, c.length, guides, 1).unwrap()).collect();
    let folder = TrainingFolder::open(&a[4], Recipe { style, guides, seed: 1, cells, source: None }).unwrap();
    folder.simulate(&body, &grooms, &seqs, &P).unwrap();
}

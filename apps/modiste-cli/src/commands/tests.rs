//! Words in, a job out.

use super::Arguments;
use clap::{CommandFactory, Parser};
use modiste::{BodyChoice, Crowd, DesignChoice, Dress, Format, Job, Length, Quantity};

fn job(words: &str) -> Job {
    Arguments::try_parse_from(words.split_whitespace()).unwrap().job().unwrap()
}

#[test]
fn the_words_are_consistent() {
    Arguments::command().debug_assert();
}

#[test]
fn dress_alone_is_the_default_job() {
    assert_eq!(job("modiste dress"), Job::Dress(Dress::default()));
    assert_eq!(job("modiste crowd"), Job::Crowd(Crowd::default()));
}

#[test]
fn measurements_and_shapes_reach_the_job() {
    let Job::Dress(dress) = job("modiste dress --height 1.8 --measure neck_girth=0.4 --frames 9") else { panic!() };
    let wanted = vec![(Quantity::Stature, 1.8), (Quantity::NeckGirth, 0.4)];
    assert_eq!(dress.body, BodyChoice::Measurements(wanted));
    assert_eq!(dress.length, Some(Length::Frames(9)));
    let Job::Dress(dress) = job("modiste dress --shape -1.5,0.7 --garments shorts --ease -0.5") else { panic!() };
    assert!((dress.ease + 0.5).abs() < 1e-12);
    assert_eq!(dress.body, BodyChoice::Shape(vec![-1.5, 0.7]));
    assert_eq!(dress.garments, ["shorts"]);
    let Job::Dress(dress) = job("modiste dress --format npz,usd,npz --fit-map") else { panic!() };
    assert_eq!((dress.formats, dress.fit_map), (vec![Format::Usd, Format::Npz], true));
}

#[test]
fn a_pattern_is_named_or_a_file() {
    let Job::GarmentLearn(learn) = job("modiste garment learn pants --gender male --out p.safetensors") else {
        panic!()
    };
    assert_eq!(learn.training.design, DesignChoice::BuiltIn("pants".into()));
    assert!(learn.training.out.ends_with("training/garments/male-pants"));
    let Job::GarmentLearn(learn) = job("modiste garment learn --pattern a/robe.json --fabric denim --out r") else {
        panic!()
    };
    assert!(matches!(&learn.training.design, DesignChoice::File { fabric: Some(fabric), .. } if fabric == "denim"));
    assert!(learn.training.out.ends_with("female-robe"));
    let Job::GarmentLearn(learn) = job("modiste garment learn --mesh a/robe.obj --body me.obj --out r") else {
        panic!()
    };
    assert!(matches!(&learn.training.design, DesignChoice::Mesh { body: Some(_), name: None, .. }));
    assert!(learn.training.out.ends_with("female-robe"));
}

#[test]
fn contradictions_and_unknown_words_are_refused() {
    for words in [
        "modiste dress --shape 1 --height 1.8",
        "modiste dress --frames 3 --seconds 1",
        "modiste bench dress --frames 0",
        "modiste bench dress --threads 1,0",
        "modiste bench hair --guides many",
        "modiste dress --measure nose=0.1",
        "modiste dress --measure neck_girth=wide",
        "modiste dress --action swim",
        "modiste dress --motion a.bvh --action walk",
        "modiste garment learn --out a.safetensors",
        "modiste garment learn skirt --pattern skirt.json --out a.safetensors",
        "modiste garment learn --mesh robe.obj --pattern skirt.json --out a.safetensors",
        "modiste garment learn skirt --body me.obj --out a.safetensors",
    ] {
        assert!(Arguments::try_parse_from(words.split_whitespace()).is_err(), "{words}");
    }
    assert!(Arguments::try_parse_from(["modiste", "body", "make"]).unwrap().job().is_err());
}

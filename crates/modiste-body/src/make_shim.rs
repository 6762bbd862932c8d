//! SHIM
use std::sync::Arc; use crate::*;
#[derive(Default, Debug)] pub struct MakeOptions; 
#[derive(Debug)] pub struct Made { pub body: Body, pub measurements: Measurements }
pub fn make(model: &Arc<ScapeModel>, _w: &[(Quantity, f64)], _o: &MakeOptions) -> Result<Made, BodyError> {
  let body = model.body(&[])?; let t = MeasureTemplate::new(model.topology(), model.face_parts()).unwrap(); let measurements = t.measure(body.rest_vertices()).unwrap(); Ok(Made{body, measurements}) }

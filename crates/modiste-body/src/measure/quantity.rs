//! What is measured: names after ISO 8559-1, units, and the table that a user sees.

use serde::{Deserialize, Serialize};

/// Declares the quantities once: field, name in tables, and unit.
macro_rules! quantities {
    ($($(#[doc = $doc:literal])+ $field:ident, $variant:ident, $name:literal, $unit:literal;)+) => {
        /// One body measurement. The discriminant is its index in [`Quantity::ALL`].
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
        #[serde(rename_all = "snake_case")]
        pub enum Quantity {
            $($(#[doc = $doc])+ $variant,)+
        }

        impl Quantity {
            /// All quantities, in the order of tables.
            pub const ALL: [Self; [$(Self::$variant),+].len()] = [$(Self::$variant),+];

            /// Name in files and on the command line, for example `chest_girth`.
            pub fn name(self) -> &'static str {
                match self { $(Self::$variant => stringify!($field),)+ }
            }

            /// Name in words, after ISO 8559-1.
            pub fn title(self) -> &'static str {
                match self { $(Self::$variant => $name,)+ }
            }

            /// `m` or `kg`.
            pub fn unit(self) -> &'static str {
                match self { $(Self::$variant => $unit,)+ }
            }
        }

        /// All measurements of one body (m, kg), defined as ANSUR II defines them and named after ISO 8559-1.
        #[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
        pub struct Measurements {
            $($(#[doc = $doc])+ pub $field: f64,)+
        }

        impl Measurements {
            /// The value of one quantity (m or kg).
            pub fn get(&self, quantity: Quantity) -> f64 {
                match quantity { $(Quantity::$variant => self.$field,)+ }
            }

            /// Sets the value of one quantity (m or kg).
            pub fn set(&mut self, quantity: Quantity, value: f64) {
                match quantity { $(Quantity::$variant => self.$field = value,)+ }
            }
        }
    };
}

quantities! {
    /// Floor to the highest point of the head, in the template pose.
    stature, Stature, "stature", "m";
    /// Volume times 1000 kg/m³.
    body_mass, BodyMass, "body mass", "kg";
    /// Horizontal, at the height of the bust points.
    chest_girth, ChestGirth, "chest (bust) girth", "m";
    /// Horizontal, at the height of the navel (omphalion).
    waist_girth, WaistGirth, "waist girth", "m";
    /// Horizontal, at the height of the greatest protrusion of the buttocks.
    hip_girth, HipGirth, "hip girth", "m";
    /// Square to the neck below the larynx.
    neck_girth, NeckGirth, "neck girth", "m";
    /// Horizontal, 2 cm below the crotch, of the left thigh.
    thigh_girth, ThighGirth, "thigh girth", "m";
    /// Horizontal, at the thickest of the left calf.
    calf_girth, CalfGirth, "calf girth", "m";
    /// Square to the left upper arm in its middle, hanging loose.
    upper_arm_girth, UpperArmGirth, "upper arm girth", "m";
    /// Square to the left forearm at the wrist.
    wrist_girth, WristGirth, "wrist girth", "m";
    /// Between the acromion points (biacromial).
    shoulder_breadth, ShoulderBreadth, "shoulder (biacromial) breadth", "m";
    /// Acromion point to the middle of the elbow, left.
    upper_arm_length, UpperArmLength, "upper arm length", "m";
    /// Middle of the elbow to the middle of the wrist, left.
    lower_arm_length, LowerArmLength, "lower arm length", "m";
    /// Acromion point over the elbow to the wrist, left.
    arm_length, ArmLength, "arm length", "m";
    /// Floor to the crotch.
    inside_leg_length, InsideLegLength, "inside leg height (crotch height)", "m";
    /// Floor to the middle of the left kneecap.
    knee_height, KneeHeight, "knee height", "m";
    /// Floor to the greatest protrusion of the buttocks.
    hip_height, HipHeight, "hip height", "m";
    /// Floor to the navel (omphalion).
    waist_height, WaistHeight, "waist height", "m";
    /// Floor to the bust points.
    bust_height, BustHeight, "bust height", "m";
    /// Floor to the cervicale (seventh neck vertebra).
    back_neck_height, BackNeckHeight, "back neck height (cervicale height)", "m";
    /// Front to back at the height of the bust points.
    chest_depth, ChestDepth, "chest depth", "m";
    /// Side to side at the height of the navel.
    waist_breadth, WaistBreadth, "waist breadth", "m";
    /// Front to back at the height of the navel.
    waist_depth, WaistDepth, "waist depth", "m";
    /// Side to side at the height of the greatest protrusion of the buttocks.
    hip_breadth, HipBreadth, "hip breadth", "m";
    /// Front to back at the height of the greatest protrusion of the buttocks.
    hip_depth, HipDepth, "hip depth", "m";
}

impl Quantity {
    /// Number of quantities.
    pub const COUNT: usize = Self::ALL.len();

    /// Index in per-quantity arrays.
    pub fn index(self) -> usize {
        self as usize
    }

    /// The quantity with this file name, if there is one.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|quantity| quantity.name() == name)
    }
}

impl std::fmt::Display for Measurements {
    /// A table: name, value, unit; one quantity a line.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        for (index, quantity) in Quantity::ALL.into_iter().enumerate() {
            let separator = if index == 0 { "" } else { "\n" };
            let decimals = if quantity.unit() == "kg" { 1 } else { 3 };
            write!(f, "{separator}{:<36}{:>8.decimals$} {}", quantity.title(), self.get(quantity), quantity.unit())?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::{Measurements, Quantity};

    #[test]
    fn names_indices_and_json_round_trip() {
        let mut measurements = Measurements::default();
        for (index, quantity) in Quantity::ALL.into_iter().enumerate() {
            assert_eq!(quantity.index(), index);
            assert_eq!(Quantity::from_name(quantity.name()), Some(quantity));
            measurements.set(quantity, index as f64 + 0.5);
        }
        let json = serde_json::to_value(measurements).expect("plain numbers");
        for quantity in Quantity::ALL {
            assert_eq!(json[quantity.name()], measurements.get(quantity));
        }
        assert_eq!(measurements.to_string().lines().count(), Quantity::COUNT);
    }
}

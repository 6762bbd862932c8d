//! Quantiles of measured values.

/// The value below which a share (0 to 1) of the values lies, interpolated between neighbours; `None` without values.
pub fn quantile(values: &[f64], share: f64) -> Option<f64> {
    let mut ascending = values.to_vec();
    ascending.sort_by(f64::total_cmp);
    let place = share.clamp(0.0, 1.0) * ascending.len().checked_sub(1)? as f64;
    let below = place.floor() as usize;
    let above = (below + 1).min(ascending.len() - 1);
    Some(ascending[below] + (place - below as f64) * (ascending[above] - ascending[below]))
}

#[cfg(test)]
mod tests {
    use super::quantile;

    #[test]
    fn between_values_it_is_interpolated() {
        assert_eq!(quantile(&[], 0.5), None);
        assert_eq!(quantile(&[4.0], 0.95), Some(4.0));
        assert_eq!(quantile(&[4.0, 1.0, 2.0], 0.5), Some(2.0));
        assert_eq!(quantile(&[10.0, 0.0], 0.95), Some(9.5));
        assert_eq!(quantile(&[10.0, 0.0], 2.0), Some(10.0));
    }
}

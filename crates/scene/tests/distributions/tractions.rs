//! Tractions that vary along their group: resultants.

use std::path::Path;

use crate::common::{BLOCK, SHEET, assert_close, moments, on_the_right, scene};

/// Checks the traction t_z = 100 (1 + 3 y) Pa on x = 2, at half of the ramp.
#[test]
fn a_linear_traction_in_space_has_the_resultant_and_moments_of_its_integral() {
    let text = on_the_right(
        BLOCK,
        "z = { type = \"ramp\", value = 100.0, end = 2.0 }\nspatial_factor = \"1 + 3*y\"",
    );
    let scene = scene(&text, Path::new(""));
    for (t, part) in [(1.0, 0.5), (2.0, 1.0)] {
        let (moments, resultant) = moments(&scene, t);
        assert_eq!(resultant[..2], [0.0, 0.0]);
        assert_close(resultant[2], part * 250.0, 500.0);
        // The expected values are the integrals of x t_z, y t_z and z t_z over the unit square.
        for (i, expected) in [500.0, 150.0, 125.0].into_iter().enumerate() {
            assert_close(moments[i][2], part * expected, 500.0);
        }
    }
}

/// Checks the traction t = 10 y (1, x) Pa on x = 2.
#[test]
fn a_linear_traction_in_the_plane_has_the_resultant_and_moment_of_its_integral() {
    let linear = "[[traction]]\ngroup = \"right\"\ny = 10.0\nspatial_factor = \"x*y\"";
    let text = on_the_right(SHEET, &format!("x = 10.0\nspatial_factor = \"y\"\n{linear}"));
    let (moments, resultant) = moments(&scene(&text, Path::new("")), 0.0);
    assert_close(resultant[0], 5.0, 20.0);
    assert_close(resultant[1], 10.0, 20.0);
    // The expected value is the integral of x F_y - y F_x, which is 2 ∫ 20 y - ∫ 10 y².
    assert_close(moments[0][1] - moments[1][0], 20.0 - 10.0 / 3.0, 20.0);
}

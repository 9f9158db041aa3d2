//! The paper's rod: the response of ten linear elements in closed form.

use myovib_scene::response::Peak;
use num_complex::Complex64;

use crate::{column, error, number, reference, response};

#[test]
fn rod_has_the_closed_form_of_its_elements() {
    let case = reference("s13_02_rod.json");
    let rows = case["rows"].as_array().unwrap();
    let frequencies: Vec<String> = rows.iter().map(|row| row["f_hz"].to_string()).collect();
    for reading in ["strain", "traction"] {
        let probes = [0.03, 0.05, 0.1]
            .map(|x| format!("[[probe]]\nname = \"p{}\"\ntype = \"rod\"\nat = {x:?}\n", 100.0 * x));
        let text = format!(
            "analysis = \"response\"\n[response]\nfrequencies = [{}]\n[rod]\nload_type = \"{reading}\"\n\
             response = {{ value = 1.0 }}\n{}",
            frequencies.join(", "),
            probes.concat()
        );
        let found = response(&text);
        for (x, probe) in [("x=0.03", "p3"), ("x=0.05", "p5"), ("x=0.1", "p10")] {
            for (found, row) in column(&found, probe, "u").into_iter().zip(rows) {
                let expected = &row[format!("{reading}_form")][x]["ten_linear_elements"];
                let expected = Complex64::new(number(&expected["re"]), number(&expected["im"]));
                // The tolerance covers about a hundred rounding errors of a well-conditioned system.
                assert!(error(found, expected) < 1e-13, "{reading} {x} {found} {expected}");
            }
        }
    }
}

/// Checks the only maximum of the tip's amplitude below 600 Hz. The second mode has the damping ratio 0.75, and the third 1.27, so that
/// they have no peaks. Linear elements with consistent masses have errors of order h².
#[test]
fn the_rod_has_a_single_peak_that_converges_to_the_continuum() {
    let case = reference("s13_02_rod.json");
    for (reading, own) in
        ["strain", "traction"].iter().zip(case["first_peak_of_tip_continuum"].as_array().unwrap())
    {
        assert_eq!(own["form"], format!("{reading}_form"));
        let [coarse, fine] = [80, 160].map(|elements| {
            let found = response(&format!(
                "analysis = \"response\"\n[response]\nfrequencies = \"10..600:adaptive\"\n[rod]\nelements = {elements}\n\
                 load_type = \"{reading}\"\nresponse = {{ value = 1.0 }}\n[[probe]]\nname = \"tip\"\ntype = \"rod\"\nat = 0.1\n"
            ));
            let peaks: Vec<&Peak> = found.peaks.iter().filter(|peak| peak.column == "u").collect();
            assert_eq!(peaks.len(), 1, "{reading}: {peaks:?}");
            let quality = 0.5 / peaks[0].damping_ratio.unwrap();
            let values = [(peaks[0].frequency, "f_peak_hz"), (peaks[0].amplitude, "amplitude"), (quality, "Q_from_width")];
            values.map(|(value, key)| (value / number(&own[key]) - 1.0).abs())
        });
        for (coarse, fine) in coarse.iter().zip(fine) {
            // The tolerance is twice the error of the closed form of 160 elements, 4.2e-6.
            assert!(fine < 8.4e-6, "{reading}: {fine:e}");
            // The limit is 4 = 2².
            assert!((3.9..4.1).contains(&(coarse / fine)), "{reading}: {coarse:e} {fine:e}");
        }
    }
}

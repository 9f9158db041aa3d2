//! The paper's rod: the response of ten linear elements in closed form.

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
                // About a hundred rounding errors of a well-conditioned system.
                assert!(error(found, expected) < 1e-13, "{reading} {x} {found} {expected}");
            }
        }
    }
}

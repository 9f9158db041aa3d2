//! Tests of `myovib doctor`.

use std::path::Path;

use crate::harness::{document, myovib};

#[test]
fn findings_are_consistent_with_the_exit_code() {
    let run = myovib(&["doctor", "--json"]);
    let found = document(&run.stdout, "doctor");
    let remedies = found["remedies"].as_array().expect("a list");
    assert_eq!(run.code, i32::from(!remedies.is_empty()), "{}", run.stdout);
    assert_eq!(found["index_bits"], 64);
    assert!(found["machine"]["cores"].as_u64().is_some_and(|n| n >= 1));
    for tool in found["build"].as_array().expect("a list") {
        if let Some(path) = tool["found"].as_str() {
            assert!(Path::new(path).exists(), "{path}");
        }
    }
}

#[test]
fn doctor_reports_the_requested_number_of_threads() {
    let found = document(&myovib(&["doctor", "--threads", "3", "--json"]).stdout, "doctor");
    assert_eq!(found["threads"], 3);
}

#[test]
fn text_has_no_escapes_without_a_terminal() {
    let run = myovib(&["doctor"]);
    assert!(!run.stdout.contains('\x1b'));
    assert!(run.stdout.contains("index width"), "{}", run.stdout);
}

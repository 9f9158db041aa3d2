use super::*;
use DataProblem::*;

const RUN: Domain = Domain { abscissa: Abscissa::Time, low: 0.0, high: 2.0 };

fn read(
    name: &Path,
    text: &str,
    outputs: &[Output],
    domain: Domain,
) -> Result<Vec<Datum>, DataError> {
    Reader::new(name, outputs, domain).read(text)
}

fn outputs() -> Vec<Output> {
    [("tip", Some(0.1)), ("root", Some(0.2))]
        .map(|(name, noise)| Output::of_test(name, noise))
        .into()
}

fn read_text(text: &str) -> Result<Vec<Datum>, DataError> {
    read(Path::new("m.csv"), text, &outputs(), RUN)
}

/// Checks that plain tables and PEtab tables with equal data give equal measurements, even if tabs separate the columns
/// and some columns have no effect.
#[test]
fn equal_tables_of_both_forms_give_equal_measurements() {
    let plain = read_text("t,tip,root,tip.noise\n1,3,4,0.5\n0,1,,\n").unwrap();
    let long = read_text(
        "observableId,time,measurement,noiseParameters\ntip,0,1,\ntip,1,3,0.5\nroot,1,4,\n",
    )
    .unwrap();
    assert_eq!(plain, long);
    let tabs = "observableId\ttime\tmeasurement\tnoiseParameters\treplicateId\tobservableParameters\t\
                simulationConditionId\tnoiseDistribution\n\
                tip\t0\t1\t\tr1\t\tc\tnormal\ntip\t1\t3\t0.5\tr1\t\tc\t\nroot\t1\t4\t\tr2\t\tc\tnormal\n";
    assert_eq!(plain, read_text(tabs).unwrap());
    let noises: Vec<Option<f64>> = plain.iter().map(|datum| datum.noise).collect();
    assert_eq!(noises, [Some(0.1), Some(0.5), Some(0.2)]);
}

/// Checks that each error reports the line and the column, even after blank lines.
#[test]
fn rejected_tables_name_the_line_and_the_column() {
    let long = |column: &str, entries: [&str; 2]| {
        format!(
            "observableId,time,measurement,{column}\ntip,0,1,{}\ntip,1,2,{}\n",
            entries[0], entries[1]
        )
    };
    let scaled = long("observableParameters", ["", "1000;0"]);
    let preequilibrated = long("preequilibrationConditionId", ["rest", "rest"]);
    let logarithmic = long("observableTransformation", ["lin", "log10"]);
    let laplace = long("noiseDistribution", ["laplace", "normal"]);
    let unit = long("unit", ["mm", "mm"]);
    let conditions = long("simulationConditionId", ["a", "b"]);
    for (text, problem, line, column) in [
        ("t,tip\n0,nan\n", NotANumber, Some(2), Some("tip")),
        ("t,tip\n0,1\n\n\n0.5,x\n", NotANumber, Some(5), Some("tip")),
        ("t,tip\n3,1\n", OutsideRun, Some(2), Some("t")),
        ("t,tip\n-1,1\n", OutsideRun, Some(2), Some("t")),
        ("t,tip\n,1\n", MissingTime, Some(2), Some("t")),
        ("t,tap\n0,1\n", UnknownOutput, None, Some("tap")),
        ("t,tip,unit\n0,1,mm\n", UnknownOutput, None, Some("unit")),
        ("t,tip,root.noise\n0,1,1\n", UnknownOutput, None, Some("root.noise")),
        ("x,tip\n0,1\n", MissingColumn, None, Some("t or time")),
        ("t,tip\n", Empty, None, None),
        ("\n", Empty, None, None),
        ("t,tip,tip\n0,1,1\n", DuplicateColumn, None, Some("tip")),
        ("t,tip\n0,1\n1\n", ShortRow, Some(3), None),
        ("t,tip\n0,1,5e-3\n", LongRow, Some(2), None),
        ("t,tip,tip.noise\n0,1,0\n", NonpositiveNoise, Some(2), Some("tip.noise")),
        ("observableId,time\ntip,1\n", MissingColumn, None, Some("measurement")),
        (&scaled, UnsupportedColumn, Some(3), Some("observableParameters")),
        (&preequilibrated, UnsupportedColumn, Some(2), Some("preequilibrationConditionId")),
        (&logarithmic, UnsupportedColumn, Some(3), Some("observableTransformation")),
        (&laplace, UnsupportedColumn, Some(2), Some("noiseDistribution")),
        (&unit, UnsupportedColumn, Some(2), Some("unit")),
        (&conditions, SeveralConditions, None, Some("simulationConditionId")),
    ] {
        let error = read_text(text).unwrap_err();
        let found = (error.problem, error.line, error.column.as_deref());
        assert_eq!(found, (problem, line, column), "{text:?}");
    }
}

#[test]
fn frequencies_are_within_the_response() {
    let read_text = |text: &str| {
        let domain = Domain { abscissa: Abscissa::Frequency, low: 1.0, high: 60.0 };
        read(Path::new("m.csv"), text, &outputs(), domain)
    };
    let plain = read_text("frequency,tip\n60,2\n1,3\n").unwrap();
    assert_eq!(plain, read_text("f,tip\n1,3\n60,2\n").unwrap());
    let long = "observableId,frequency,measurement\ntip,60,2\ntip,1,3\n";
    assert_eq!(plain, read_text(long).unwrap());
    for (text, problem, line) in [
        ("f,tip\n61,1\n", OutsideFrequencies, Some(2)),
        ("f,tip\n1,1\n-1,1\n", OutsideFrequencies, Some(3)),
        ("t,tip\n1,1\n", MissingColumn, None),
        ("f,tip\n,1\n", MissingTime, Some(2)),
    ] {
        let error = read_text(text).unwrap_err();
        assert_eq!((error.problem, error.line), (problem, line), "{text:?}");
    }
}

/// Regression: because of rounding, the last value of `numpy.arange(0.1, 2.001, 0.05)` exceeds 2.
#[test]
fn rounded_times_are_within_the_run() {
    let data = read(Path::new("m.csv"), "t,tip\n2.0000000000000004,1\n", &outputs(), RUN).unwrap();
    assert_eq!(data[0].t, 2.0);
}

/// Checks load factors on a path from −0.5 to 1.
#[test]
fn load_factors_are_within_the_path() {
    let domain = Domain { abscissa: Abscissa::Load, low: -0.5, high: 1.0 };
    let read_text = |text: &str| read(Path::new("m.csv"), text, &outputs(), domain);
    let plain = read_text("load,tip\n1,2\n-0.5,3\n").unwrap();
    let long = "observableId,load,measurement\ntip,1,2\ntip,-0.5,3\n";
    assert_eq!(plain, read_text(long).unwrap());
    for (text, problem, line) in [
        ("load,tip\n1.01,1\n", OutsideLoads, Some(2)),
        ("load,tip\n1,1\n-1,1\n", OutsideLoads, Some(3)),
        ("t,tip\n1,1\n", MissingColumn, None),
    ] {
        let error = read_text(text).unwrap_err();
        assert_eq!((error.problem, error.line), (problem, line), "{text:?}");
    }
}

#[test]
fn files_that_are_not_text_are_rejected() {
    let folder = tempfile::tempdir().unwrap();
    let latin = folder.path().join("latin.csv");
    std::fs::write(&latin, b"t,tip\n0,1\n1,\xe9\n").unwrap();
    let problem = |file: &Path| {
        let error = read_file(file, &outputs(), RUN).unwrap_err();
        (error.problem, error.line)
    };
    assert_eq!(problem(&latin), (NotUtf8, Some(3)));
    // Reading a device or a pipe may never end.
    for device in ["/dev/zero", "/dev/null"] {
        assert_eq!(problem(Path::new(device)), (Unreadable, None));
    }
    assert_eq!(problem(folder.path()), (Unreadable, None));
}

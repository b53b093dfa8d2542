//! Every mistake in a configuration is named, with its file and line, and all of them at once.

use std::path::{Path, PathBuf};

use daemon::config::{PlantFlags, load_diagnoser, load_plant};
use tempfile::TempDir;
use toml::de::{DeTable, DeValue};

/// A copy of the shipped files that may be spoilt.
struct Copy(TempDir);

impl Copy {
    fn new() -> Self {
        let folder = TempDir::new().unwrap();
        for name in ["tower", "thresholds", "references"] {
            std::fs::create_dir(folder.path().join(name)).unwrap();
        }
        for file in [
            "tower.toml",
            "plant.toml",
            "module1.toml",
            "tower/module1.structure.toml",
            "thresholds/module1.toml",
            "thresholds/module2.toml",
            "references/module1.toml",
            "references/module2.toml",
        ] {
            let from = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../configs").join(file);
            std::fs::copy(from, folder.path().join(file)).unwrap();
        }
        Self(folder)
    }

    fn path(&self, file: &str) -> PathBuf {
        self.0.path().join(file)
    }

    /// Replaces a part of a file's line; its number.
    fn spoil(&self, file: &str, from: &str, to: &str) -> usize {
        let text = std::fs::read_to_string(self.path(file)).unwrap();
        let place = text.find(from).unwrap();
        std::fs::write(self.path(file), text.replacen(from, to, 1)).unwrap();
        text[..place].lines().count().max(1) + usize::from(text[..place].ends_with('\n'))
    }

    fn module_errors(&self) -> String {
        load_diagnoser(&self.path("module1.toml")).unwrap_err().to_string()
    }

    fn plant_errors(&self, flags: &PlantFlags) -> String {
        load_plant(&self.path("plant.toml"), flags).unwrap_err().to_string()
    }
}

#[test]
fn a_misspelt_key_is_refused_with_its_line_and_the_keys_that_exist() {
    for (from, to) in [
        ("hold_ms = 6", "holdms = 6"),
        ("window = 12", "windows = 12"),
        ("peers =", "pears ="),
        ("area_a_m2", "area_a_mm2"),
        ("[publish]", "[published]"),
        ("timeout_ms", "time_out_ms"),
    ] {
        let copy = Copy::new();
        let line = copy.spoil("module1.toml", from, to);
        let error = copy.module_errors();
        let wrong = to.split(['=', ' ']).next().unwrap().trim_matches(['[', ']']);
        assert!(error.contains(&format!("module1.toml:{line}: ")), "{to}: {error}");
        assert!(error.contains(&format!("unknown field `{wrong}`")), "{to}: {error}");
    }
}

#[test]
fn a_misspelt_key_of_the_plant_is_refused_with_its_line() {
    for (from, to) in
        [("seed = 1", "sead = 1"), ("window_steps", "window"), ("step_s =", "steps_s =")]
    {
        let copy = Copy::new();
        let line = copy.spoil("plant.toml", from, to);
        let error = copy.plant_errors(&PlantFlags::default());
        let wrong = to.split(' ').next().unwrap();
        let reported = format!("plant.toml:{line}: unknown field `{wrong}`");
        assert!(error.contains(&reported), "{error}");
    }
}

#[test]
fn an_address_for_health_that_is_none_is_refused_with_its_line() {
    let copy = Copy::new();
    for file in ["module1.toml", "plant.toml"] {
        let line = copy.spoil(file, "[network]", "[health]\nlisten = \"localhost\"\n[network]") + 1;
        let error = match file {
            "plant.toml" => copy.plant_errors(&PlantFlags::default()),
            _ => copy.module_errors(),
        };
        let expected = format!(
            "{file}:{line}: `localhost` is not an address with a port; write e.g. `127.0.0.1:9464`"
        );
        assert!(error.contains(&expected), "{error}");
    }
    let error = copy.module_errors();
    copy.spoil("module1.toml", "listen = \"localhost\"", "listens = \"127.0.0.1:9464\"");
    assert_ne!(error, copy.module_errors());
    assert!(copy.module_errors().contains("unknown field `listens`"));
}

#[test]
fn thresholds_for_other_settings_are_refused_and_the_setting_is_named() {
    let copy = Copy::new();
    copy.spoil("module1.toml", "lag = 5 ", "lag = 12 ");
    let error = copy.module_errors();
    assert!(error.contains("thresholds/module1.toml:") && error.contains("`lag` was 5"), "{error}");
    assert!(error.contains("configured with 12"), "{error}");
}

#[test]
fn thresholds_of_another_module_are_refused() {
    let copy = Copy::new();
    copy.spoil("module1.toml", "thresholds/module1.toml", "thresholds/module2.toml");
    assert!(copy.module_errors().contains("the thresholds of `module2`; give those of `module1`"));
}

#[test]
fn missing_and_unknown_channels_are_named() {
    let copy = Copy::new();
    let line = copy.spoil("thresholds/module1.toml", "\"sensor/g8\"", "\"sensor/g9\"");
    let error = copy.module_errors();
    assert!(error.contains("no threshold for `sensor/g8`"), "{error}");
    let unknown = format!("thresholds/module1.toml:{line}: `sensor/g9` is not a component");
    assert!(error.contains(&unknown), "{error}");
}

#[test]
fn all_mistakes_are_reported_at_once_each_with_its_line() {
    let copy = Copy::new();
    // what stood there becomes a comment, whatever it was
    let mistakes = [
        ("gage_noise_strain = ", "gage_noise_strain = -1.0 #"),
        ("largest_strain = ", "largest_strain = 0 #"),
        ("# largest_pressure_pa = ", "largest_pressure_pa = 1.0 #"),
        ("window = ", "window = 0 #"),
        ("warm_up_vectors = ", "warm_up_vectors = 0 #"),
        ("hold_ms = 6", "hold_ms = 1 # 6"),
        ("tank_pa = ", "tank_pa = nan #"),
        ("status_every_ms = ", "status_every_ms = 0 #"),
        ("pause_ms = ", "pause_ms = 99999 #"),
        ("peers = ", "peers = [\"module1\"] #"),
        ("listen = ", "listen = [\"7448\"] #"),
    ];
    let lines: Vec<usize> =
        mistakes.iter().map(|(from, to)| copy.spoil("module1.toml", from, to)).collect();
    let error = copy.module_errors();
    for ((_, to), line) in mistakes.iter().zip(lines) {
        let key = to.split(' ').next().unwrap();
        let reported = error.lines().any(|text| text.contains(&format!("module1.toml:{line}: ")));
        assert!(reported, "{key} in line {line}:\n{error}");
    }
}

#[test]
fn files_that_are_missing_are_named() {
    let copy = Copy::new();
    copy.spoil("module1.toml", "tower/module1.structure.toml", "tower/none.toml");
    copy.spoil("module1.toml", "thresholds/module1.toml", "thresholds/none.toml");
    let error = copy.module_errors();
    for file in ["tower/none.toml: cannot be read", "thresholds/none.toml: cannot be read"] {
        assert!(error.contains(file), "{error}");
    }
    let error = load_diagnoser(&copy.path("none.toml")).unwrap_err().to_string();
    assert!(error.contains("none.toml: cannot be read"), "{error}");
}

#[test]
fn mistakes_in_the_structure_are_reported_with_its_own_lines() {
    let copy = Copy::new();
    let line = copy.spoil("tower/module1.structure.toml", "alpha_per_s", "alpha");
    let error = copy.module_errors();
    assert!(error.contains(&format!("module1.structure.toml:{line}: ")), "{error}");
}

#[test]
fn a_module_that_the_structure_does_not_have_is_refused() {
    let copy = Copy::new();
    copy.spoil("module1.toml", "module = \"module1\"", "module = \"module7\"");
    assert!(copy.module_errors().contains("module1.toml:3: "), "{}", copy.module_errors());
    assert!(copy.module_errors().contains("no module `module7`"), "{}", copy.module_errors());
}

#[test]
fn no_module_may_be_called_like_the_plant() {
    let copy = Copy::new();
    copy.spoil("module1.toml", "peers = [\"module2\"]", "peers = [\"plant\"]");
    assert!(copy.module_errors().contains("no module may be called `plant`"));
}

#[test]
fn a_file_of_zenoh_settings_that_is_none_is_named_and_excludes_the_mode() {
    let copy = Copy::new();
    std::fs::write(copy.path("bad.json5"), "{ mode: \"peer\", scouting: { multicast: 7 } }")
        .unwrap();
    copy.spoil("module1.toml", "[network]", "[network]\nzenoh = \"bad.json5\"\nmode = \"peer\"");
    let error = copy.module_errors();
    assert!(error.contains("bad.json5` is not a file of Zenoh settings"), "{error}");
    assert!(error.contains("`mode` has no effect beside `zenoh`"), "{error}");
}

#[test]
fn mistakes_of_the_plant_are_reported_at_once() {
    let copy = Copy::new();
    let wait = copy.spoil("plant.toml", "\"module2\"]", "\"module9\"]");
    let window = copy.spoil("plant.toml", "window_steps = 200", "window_steps = 0");
    let step = copy.spoil("plant.toml", "step_s = 1e-3", "step_s = 1.0");
    let error = copy.plant_errors(&PlantFlags::default());
    for (line, named) in
        [(wait, "`module9`"), (window, "`window_steps` is 0"), (step, "`step_s` is 1")]
    {
        assert!(error.contains(&format!("plant.toml:{line}: ")), "{line} {error}");
        assert!(error.contains(named), "{error}");
    }
}

#[test]
fn figures_that_no_module_has_are_named_with_line_range_and_unit() {
    let copy = Copy::new();
    let strain = copy.spoil("module1.toml", "largest_strain = 0.1", "largest_strain = 1e-9");
    let noise =
        copy.spoil("module1.toml", "gage_noise_strain = 0.3e-6", "gage_noise_strain = 1e-20");
    let area = copy.spoil("module1.toml", "area_a_m2 = 1.3273e-2", "area_a_m2 = 1e-300");
    let error = copy.module_errors();
    for (line, problem) in [
        (strain, "`largest_strain` is 1e-9; use a number from 1e-5 to 1: strain in m/m"),
        (noise, "`gage_noise_strain` is 1e-20; use a number from 1e-12 to 0.01"),
        (area, "`area_a_m2` is 1e-300; use 1e-8 to 1e2 m²"),
    ] {
        assert!(error.contains(&format!("module1.toml:{line}: ")), "{line} {error}");
        assert!(error.contains(problem), "{problem}: {error}");
    }
    let copy = Copy::new();
    let area =
        copy.spoil("plant.toml", "[network]", "[plant.gages]\nnoise_strain = 1e-20\n[network]") + 1;
    let error = copy.plant_errors(&PlantFlags::default());
    let said = format!("plant.toml:{area}: `gages.noise_strain` is 1e-20; use 1e-15 to 1e-2 m/m");
    assert!(error.contains(&said), "{error}");
}

#[test]
fn a_step_that_no_module_has_is_named_and_not_what_follows_from_it() {
    for step_s in ["10.0", "100.0", "1e-9", "-1.0", "nan"] {
        let copy = Copy::new();
        let line = copy.spoil("module1.toml", "step_s = 1e-3", &format!("step_s = {step_s}"));
        let error = copy.module_errors();
        assert!(error.contains(&format!("module1.toml:{line}: `step_s` is ")), "{error}");
        assert!(error.contains("use a step from 1e-6 to 1 s"), "{error}");
        assert!(!error.contains("_ms"), "{error}");
    }
}

#[test]
fn a_speed_that_is_none_is_refused_with_what_would_be_right() {
    let copy = Copy::new();
    let line = copy.spoil("plant.toml", "\"real\"\n", "\"fast\"\n");
    let error = copy.plant_errors(&PlantFlags::default());
    assert!(error.contains(&format!("plant.toml:{line}: ")), "{error}");
    assert!(error.contains("expected `max`, `real` or a factor"), "{error}");
}

#[test]
fn a_schedule_is_tried_on_the_plant() {
    let copy = Copy::new();
    let schedule = copy.path("faults.toml");
    let flags = PlantFlags { schedule: Some(schedule.clone()), ..PlantFlags::default() };
    let faults = |component: &str, fault: &str| {
        let text = format!(
            "[[faults]]\nat_step = 10\nuntil_step = 5\ncomponent = \"{component}\"\nfault = {fault}\n"
        );
        std::fs::write(&schedule, text).unwrap();
        copy.plant_errors(&flags)
    };
    let error = faults("module1/sensor/g9", "{ kind = \"zero_output\" }");
    assert!(error.contains("not after `at_step` 10"), "{error}");
    let text = "[[faults]]\nat_step = 10\ncomponent = \"module1/sensor/g9\"\nfault = { kind = \"zero_output\" }\n";
    std::fs::write(&schedule, text).unwrap();
    let error = copy.plant_errors(&flags);
    assert!(error.contains("faults.toml: there is no `module1/sensor/g9`"), "{error}");
    let error = faults("module1/sensor/g1", "{ kind = \"bias\" }");
    assert!(error.contains("offset_m"), "{error}");
}

#[test]
fn what_a_file_says_forges_no_further_line() {
    let copy = Copy::new();
    copy.spoil("module1.toml", "[publish]", "\"a\\nERROR b\" = 1\n[publish]");
    let error = copy.module_errors();
    assert!(error.contains("ERROR b") && error.lines().count() == 1, "{error}");
}

#[test]
fn settings_that_are_left_open_fit_every_sampling_rate() {
    let copy = Copy::new();
    let file = copy.path("module1.toml");
    let shipped = std::fs::read_to_string(&file).unwrap();
    let at = |rate_hz: f64, more: &str| {
        let mut tables: Vec<&str> = shipped.split("\n[").collect();
        tables.retain(|table| {
            !["isolation]", "publish]", "queries]", "input]"]
                .iter()
                .any(|name| table.starts_with(name))
        });
        let text = tables.join("\n[").replace("reference = ", "# ");
        let text = text.replace("step_s = 1e-3", &format!("step_s = {}", 1.0 / rate_hz));
        std::fs::write(&file, format!("{text}\n{more}")).unwrap();
        load_diagnoser(&file)
    };
    for rate_hz in
        [1.0, 10.0, 50.0, 100.0, 200.0, 250.0, 333.0, 500.0, 1000.0, 2000.0, 5000.0, 10_000.0]
    {
        let config = at(rate_hz, "").unwrap_or_else(|errors| panic!("{rate_hz} Hz: {errors}"));
        let step_ms = 1e3 / rate_hz;
        assert!(config.input.stale_after_ms as f64 >= 5.0 * step_ms, "{rate_hz} Hz");
        let seconds = config.publish.progress_every_steps as f64 / rate_hz;
        assert!(seconds <= 0.025 || config.publish.progress_every_steps == 1, "{rate_hz} Hz");
    }
    let fitted = at(1000.0, "").unwrap();
    assert_eq!((fitted.input, fitted.queries, fitted.publish), Default::default());
    // What is written counts, and what follows from it follows.
    assert!(at(100.0, "[isolation]\ntie_ms = 30").is_ok());
    let errors = at(100.0, "[isolation]\nhold_ms = 10").unwrap_err().to_string();
    assert!(errors.contains("`hold_ms` is 10; use at least twice tie_ms, 20"), "{errors}");
}

/// Every number of a document: where its text stands, and the keys that lead to it.
fn numbers(text: &str) -> Vec<(std::ops::Range<usize>, Vec<String>)> {
    fn walk(
        value: &toml::Spanned<DeValue<'_>>,
        keys: &[String],
        found: &mut Vec<(std::ops::Range<usize>, Vec<String>)>,
    ) {
        match value.get_ref() {
            DeValue::Integer(_) | DeValue::Float(_) => found.push((value.span(), keys.to_vec())),
            DeValue::Array(values) => values.iter().for_each(|value| walk(value, keys, found)),
            DeValue::Table(table) => table.iter().for_each(|(key, value)| {
                let keys = [keys, &[key.get_ref().to_string()]].concat();
                walk(value, &keys, found);
            }),
            _ => {}
        }
    }
    let mut found = Vec::new();
    let table = DeTable::parse(text).unwrap();
    for (key, value) in table.get_ref() {
        walk(value, &[key.get_ref().to_string()], &mut found);
    }
    found
}

/// Is a number of this key right if it is negative, infinite or the largest one?
fn is_in_range(key: &str, mutation: &str) -> bool {
    match mutation {
        "-" => {
            let signed = ["mean", "correlations", "least_n", "position_m", "local_y", "largest_n"];
            signed.contains(&key)
        }
        "inf" => key == "root_ratio",
        "9223372036854775807" => ["seed", "root_ratio"].contains(&key),
        _ => false,
    }
}

#[test]
fn every_number_that_cannot_be_right_is_refused_by_its_name() {
    let copy = Copy::new();
    std::fs::write(copy.path("storm.toml"), include_str!("../../../../configs/storm.toml"))
        .unwrap();
    let files = [
        ("module1.toml", 1),
        ("thresholds/module1.toml", 1),
        ("references/module1.toml", 41),
        ("tower/module1.structure.toml", 7),
        ("plant.toml", 1),
        ("storm.toml", 1),
    ];
    let mut wrong = Vec::new();
    for (file, every) in files {
        let path = copy.path(file);
        let text = std::fs::read_to_string(&path).unwrap();
        let all = numbers(&text);
        for (place, keys) in all.iter().step_by(every) {
            let number = &text[place.clone()];
            let is_integer = number.parse::<i64>().is_ok();
            for mutation in ["nan", "inf", "-inf", "1e300", "9223372036854775807", "-"] {
                let is_for = is_integer == (mutation == "9223372036854775807") || mutation == "-";
                let is_zero = number.parse::<f64>() == Ok(0.0);
                if !is_for || mutation == "-" && (is_zero || number.starts_with('-')) {
                    continue;
                }
                let other =
                    if mutation == "-" { format!("-{number}") } else { mutation.to_owned() };
                let mut changed = text.clone();
                changed.replace_range(place.clone(), &other);
                std::fs::write(&path, changed).unwrap();
                let said = if file == "plant.toml" || file == "storm.toml" {
                    load_plant(&path, &PlantFlags::default()).map(drop)
                } else {
                    load_diagnoser(&copy.path("module1.toml")).map(drop)
                };
                let key = keys.last().unwrap();
                let may_be = is_in_range(key, mutation);
                let is_right = match &said {
                    Ok(()) => may_be,
                    Err(errors) => {
                        let said = errors.to_string();
                        may_be || keys.iter().any(|key| said.contains(key.as_str()))
                    }
                };
                if !is_right {
                    wrong.push(format!("{file}: {} = {other}: {said:?}", keys.join(".")));
                }
            }
        }
        std::fs::write(&path, text).unwrap();
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn a_byte_that_is_no_text_is_named_with_its_place() {
    let copy = Copy::new();
    std::fs::write(copy.path("module1.toml"), b"a = 1\nb = \"M\xfcnchen\"\n").unwrap();
    let wanted =
        "module1.toml:2: byte 0xfc at place 7 of the line is not UTF-8; save the file as UTF-8";
    assert!(copy.module_errors().ends_with(wanted), "{}", copy.module_errors());
}

/// Both files of a journal are read at each start.
#[test]
fn a_journal_that_would_take_long_to_read_is_refused() {
    let copy = Copy::new();
    copy.spoil("module1.toml", "rotate_mib = 16", "rotate_mib = 1000");
    let error = copy.module_errors();
    assert!(error.contains("`rotate_mib` is 1000; use 1 to 32"), "{error}");
}

//! One file after another, and the oldest deleted.

mod common;

use std::collections::BTreeMap;
use std::fs;

use common::{read, sample};
use recording::{FileLimits, Metadata, Recorded, Recording, RecordingFiles, Writer};

const SECOND: u64 = 1_000_000_000;
const NOW: u64 = 1_795_667_100 * SECOND;
const LIMITS: FileLimits =
    FileLimits { file_bytes: 1 << 40, file_ns: 60 * SECOND, quota_bytes: u64::MAX };

fn configuration() -> Recorded {
    let topic = "trusswatch/tower/module1/configuration".to_owned();
    Recorded::received(topic, b"{}".to_vec(), NOW)
}

#[test]
fn after_its_time_a_file_is_followed_by_another_with_configurations_and_notes_again() {
    let directory = tempfile::tempdir().unwrap();
    let mut files = RecordingFiles::new(directory.path(), "tower", LIMITS);
    let values = BTreeMap::from([("software".to_owned(), "1.0".to_owned())]);
    let note = Metadata { name: "module/module1".to_owned(), values };
    files.write(&sample(0), NOW).unwrap();
    files.write_in_each(configuration(), NOW).unwrap();
    files.note(note.clone(), NOW).unwrap();
    files.sync(NOW + 59 * SECOND).unwrap();
    files.write(&sample(1), NOW + 59 * SECOND).unwrap();
    files.sync(NOW + 60 * SECOND).unwrap();
    assert!(files.present().is_none());
    files.write(&sample(2), NOW + 61 * SECOND).unwrap();
    files.lose("trusswatch/tower/module1/sample", 3, "no room", NOW + 62 * SECOND).unwrap();
    files.lose("trusswatch/tower/module1/sample", 2, "no room", NOW + 63 * SECOND).unwrap();
    files.finish().unwrap();

    let [first, second] = files.begun() else { panic!("{:?}", files.begun()) };
    assert!(first < second);
    assert_eq!(first.file_name().unwrap(), "tower-20261126T042500Z-0001.mcap");
    assert_eq!(second.file_name().unwrap(), "tower-20261126T042601Z-0002.mcap");
    assert_eq!(read(first), [sample(0), configuration(), sample(1)]);
    let later = read(second);
    assert_eq!(later[..2], [configuration(), sample(2)]);
    assert_eq!(later[3].topic, "trusswatch/tower/recorder/loss");
    let loss: serde_json::Value = serde_json::from_slice(&later[3].payload).unwrap();
    assert_eq!((&loss["count"], &loss["total"]), (&2.into(), &5.into()));
    let metadata = Recording::open(second).unwrap().metadata().unwrap();
    assert_eq!(metadata[0], note);
    assert_eq!(metadata[1].name, "losses");
    assert_eq!(metadata[1].values["trusswatch/tower/module1/sample"], "5");
}

#[test]
fn a_long_file_is_followed_by_another_and_none_is_overwritten() {
    let directory = tempfile::tempdir().unwrap();
    let limits = FileLimits { file_bytes: 20_000, ..LIMITS };
    let taken = directory.path().join("tower-20261126T042500Z-0001.mcap");
    fs::write(&taken, "mine").unwrap();
    let mut files = RecordingFiles::new(directory.path(), "tower", limits);
    for step in 0..200 {
        files.write(&sample(step), NOW).unwrap();
        if step % 10 == 9 {
            files.sync(NOW).unwrap();
        }
    }
    files.finish().unwrap();
    assert!(files.begun().len() > 2, "{:?}", files.begun());
    assert!(files.begun().iter().all(|file| fs::metadata(file).unwrap().len() < 40_000));
    let all: Vec<Recorded> = files.begun().iter().flat_map(|file| read(file)).collect();
    assert_eq!(all, (0..200).map(sample).collect::<Vec<_>>());
    assert_eq!(fs::read(&taken).unwrap(), b"mine");
}

#[test]
fn a_file_is_long_enough_by_what_follows_its_head() {
    let directory = tempfile::tempdir().unwrap();
    let limits = FileLimits { file_bytes: 20_000, ..LIMITS };
    let mut files = RecordingFiles::new(directory.path(), "tower", limits);
    for _ in 0..100 {
        files.write_head(&sample(7), NOW).unwrap();
        files.sync(NOW).unwrap();
    }
    assert!(files.present().unwrap().1 > 20_000 && files.begun().len() == 1);
    files.hold(true);
    for step in 0..400 {
        files.write(&sample(step), NOW).unwrap();
        files.sync(NOW).unwrap();
    }
    assert_eq!(files.begun().len(), 1, "its head may still come");
    files.hold(false);
    for step in 0..400 {
        files.write(&sample(step), NOW).unwrap();
        files.sync(NOW).unwrap();
    }
    assert!(files.begun().len() > 1, "{:?}", files.begun());
}

#[test]
fn the_oldest_of_the_same_name_are_deleted_and_never_what_is_being_written() {
    let directory = tempfile::tempdir().unwrap();
    let place = |name: &str| directory.path().join(name);
    let others = ["tower-2-20200101T000000Z-0001.mcap", "tower.mcap", "notes"].map(place);
    for other in &others {
        fs::write(other, vec![0; 100_000]).unwrap();
    }
    let elsewhere = Writer::create(&place("tower-20190101T000000Z-0001.mcap")).unwrap();
    let old = ["tower-20200101T000000Z-0001.mcap", "tower-20200102T000000Z-0001.mcap"].map(place);
    for old in &old {
        fs::write(old, vec![0; 30_000]).unwrap();
    }
    let limits = FileLimits { file_bytes: 20_000, quota_bytes: 60_000, ..LIMITS };
    let mut files = RecordingFiles::new(directory.path(), "tower", limits);
    files.write(&sample(0), NOW).unwrap();
    assert_eq!(files.take_deleted(), [old[0].clone()]);
    for step in 1..600 {
        files.write(&sample(step), NOW).unwrap();
        files.sync(NOW).unwrap();
    }
    files.finish().unwrap();
    assert!(others.iter().all(|other| other.exists()) && elsewhere.file().exists());
    assert!(!old[1].exists());
    let left: Vec<_> = files.begun().iter().filter(|file| file.exists()).collect();
    assert!(left.len() < files.begun().len() && !left.is_empty());
    let total: u64 = left.iter().map(|file| fs::metadata(file).unwrap().len()).sum();
    assert!(total <= 60_000 + 40_000, "{total}");
}

#[test]
fn a_disk_that_fails_costs_what_was_not_on_it_and_another_file_is_begun() {
    let directory = tempfile::tempdir().unwrap();
    let place = directory.path().join("recordings");
    let mut files = RecordingFiles::new(&place, "tower", LIMITS);
    let error = files.write(&sample(0), NOW).unwrap_err().to_string();
    assert!(error.contains("recordings"), "{error}");
    assert!(files.lose("t/s/m", 1, "the disk fails", NOW).is_err());
    assert_eq!(files.losses()["t/s/m"], 1, "counted all the same");
    assert_eq!(files.losses()[&sample(0).topic], 1);
    fs::create_dir(&place).unwrap();
    files.write(&sample(1), NOW).unwrap();
    files.finish().unwrap();
    assert_eq!(read(&files.begun()[0]), [sample(1)]);
    let metadata = Recording::open(&files.begun()[0]).unwrap().metadata().unwrap();
    assert_eq!(metadata[0].values["t/s/m"], "1");
}

#[test]
fn recorders_that_begin_in_the_same_directory_at_once_take_different_names() {
    let directory = tempfile::tempdir().unwrap();
    std::thread::scope(|scope| {
        for step in 0..8 {
            let mut files = RecordingFiles::new(directory.path(), "tower", LIMITS);
            scope.spawn(move || {
                files.write(&sample(step), NOW).unwrap();
                files.finish().unwrap();
            });
        }
    });
    let files = fs::read_dir(directory.path()).unwrap();
    let mut found: Vec<_> = files.flat_map(|file| read(&file.unwrap().path())).collect();
    found.sort_by_key(|message| message.sequence);
    assert_eq!(found, (0..8).map(sample).collect::<Vec<_>>());
}

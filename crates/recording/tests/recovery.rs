//! Damaged and unfinished files become finished ones, those of others too.

mod common;

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io::BufWriter;

use common::{read, sample, write};
use mcap::records::{MessageHeader, Metadata};
use mcap::{Attachment, Compression, WriteOptions};
use recording::{Ending, recover};

#[test]
fn a_torn_file_becomes_a_finished_one() {
    let directory = tempfile::tempdir().unwrap();
    let [whole, torn, mended] =
        ["a.mcap", "b.mcap", "c.mcap"].map(|name| directory.path().join(name));
    let synced = write(&whole, 60, 20);
    let cut = synced[2].0 + 200;
    fs::write(&torn, &fs::read(&whole).unwrap()[..cut as usize]).unwrap();
    let recovered = recover(&torn, &mended).unwrap();
    assert_eq!((recovered.messages, &*recovered.problems), (40, &[] as &[String]));
    assert!(matches!(recovered.ending, Ending::WithinChunk(_)), "{}", recovered.ending);
    assert_eq!(read(&mended), (0..40).map(sample).collect::<Vec<_>>());
    assert!(mcap::Summary::read(&fs::read(&mended).unwrap()).unwrap().is_some());
    let error = recover(&torn, &mended).unwrap_err().to_string();
    let names = error.contains("c.mcap") && error.contains("File exists");
    assert!(names, "nothing is overwritten: {error}");
}

#[test]
fn a_damaged_chunk_is_left_out_and_the_rest_is_kept() {
    let directory = tempfile::tempdir().unwrap();
    let [file, mended] = ["a.mcap", "b.mcap"].map(|name| directory.path().join(name));
    let synced = write(&file, 60, 20);
    let mut bytes = fs::read(&file).unwrap();
    for (chunk, (begins, _)) in synced[..3].iter().enumerate() {
        let middle = (begins + 1000) as usize;
        bytes[middle] ^= 16;
        fs::write(&file, &bytes).unwrap();
        bytes[middle] ^= 16;
        let _ = fs::remove_file(&mended);
        let recovered = recover(&file, &mended).unwrap();
        // That of the chunk, that of all data.
        assert_eq!(recovered.problems.len(), 2, "{:?}", recovered.problems);
        assert_eq!((recovered.messages, recovered.ending), (40, Ending::Finished));
        let chunk = chunk as u64 * 20;
        let left = (0..chunk).chain(chunk + 20..60);
        assert_eq!(read(&mended), left.map(sample).collect::<Vec<_>>());
    }
}

#[test]
fn a_file_of_others_keeps_what_it_has() {
    let directory = tempfile::tempdir().unwrap();
    for (name, compression) in
        [("lz4", Some(Compression::Lz4)), ("zstd", Some(Compression::Zstd)), ("none", None)]
    {
        let [file, mended] = ["a", "b"].map(|end| directory.path().join(format!("{name}-{end}")));
        let options =
            WriteOptions::new().profile("ros2").library("theirs").compression(compression);
        let mut theirs = options.create(BufWriter::new(File::create(&file).unwrap())).unwrap();
        let schema = theirs.add_schema_with_id(7, "pkg/Type", "ros2msg", b"float64 x").unwrap();
        let about = BTreeMap::from([("qos".to_owned(), "reliable".to_owned())]);
        let channel_id = theirs.add_channel_with_id(9, schema, "/imu", "cdr", &about).unwrap();
        let attachment = Attachment {
            log_time: 1,
            create_time: 2,
            name: "photo".to_owned(),
            media_type: "image/png".to_owned(),
            data: vec![1, 2, 3].into(),
        };
        theirs.attach(&attachment).unwrap();
        let metadata = Metadata { name: "m".to_owned(), metadata: about.clone() };
        theirs.write_metadata(&metadata).unwrap();
        theirs.write_private_record(0x99, &[5], Default::default()).unwrap();
        for step in 0..50 {
            let header =
                MessageHeader { channel_id, sequence: step, log_time: 10, publish_time: 11 };
            theirs.write_to_known_channel(&header, &step.to_le_bytes()).unwrap();
        }
        theirs.flush().unwrap();
        let unfinished = theirs.into_inner().into_inner().unwrap();
        drop(unfinished);

        let recovered = recover(&file, &mended).unwrap();
        assert_eq!((recovered.messages, recovered.problems.len()), (50, 0), "{recovered:?}");
        let bytes = fs::read(&mended).unwrap();
        let summary = mcap::Summary::read(&bytes).unwrap().unwrap();
        let schema = &summary.schemas[&7];
        assert_eq!((&*schema.name, &*schema.encoding), ("pkg/Type", "ros2msg"));
        let channel = &summary.channels[&9];
        assert_eq!((&*channel.message_encoding, &channel.metadata), ("cdr", &about));
        let index = &summary.attachment_indexes[0];
        assert_eq!(mcap::read::attachment(&bytes, index).unwrap(), attachment);
        assert_eq!(mcap::read::metadata(&bytes, &summary.metadata_indexes[0]).unwrap(), metadata);
        for (step, message) in mcap::MessageStream::new(&bytes).unwrap().enumerate() {
            let message = message.unwrap();
            assert_eq!((message.log_time, message.publish_time), (10, 11));
            assert_eq!(message.data.as_ref(), (step as u32).to_le_bytes());
        }
    }
}

//! What was written is read, as far as it reached the disk, and nothing that was damaged.

mod common;

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io::BufWriter;

use common::{read, sample, write};
use mcap::records::MessageHeader;
use mcap::{MessageStream, WriteOptions};
use proptest::prelude::*;
use recording::{Ending, Metadata, Recorded, Recording, Writer};

fn any_message() -> impl Strategy<Value = Recorded> {
    let topic = prop_oneof![
        Just("trusswatch/tower/module1/sample"),
        Just("trusswatch/tower/module2/fault/sensor/g1"),
        Just("trusswatch/tower/plant/status"),
        Just("elsewhere"),
    ];
    (topic, any::<u64>(), any::<u32>(), prop::collection::vec(any::<u8>(), 0..3000)).prop_map(
        |(topic, time_unix_ns, sequence, payload)| Recorded {
            topic: topic.to_owned(),
            time_unix_ns,
            sequence,
            payload,
        },
    )
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn what_is_written_is_read(messages in prop::collection::vec(any_message(), 0..40), sync in 1usize..9) {
        let directory = tempfile::tempdir().unwrap();
        let file = directory.path().join("a.mcap");
        let mut writer = Writer::create(&file).unwrap();
        for (index, message) in messages.iter().enumerate() {
            writer.write(message).unwrap();
            if index % sync == 0 {
                writer.sync().unwrap();
            }
        }
        writer.finish().unwrap();
        prop_assert_eq!(read(&file), messages);
    }
}

#[test]
fn chunks_are_of_one_mebibyte_at_most_and_the_library_reads_them() {
    let directory = tempfile::tempdir().unwrap();
    let file = directory.path().join("a.mcap");
    write(&file, 6000, u64::MAX);
    let bytes = fs::read(&file).unwrap();
    let summary = mcap::Summary::read(&bytes).unwrap().unwrap();
    assert!(summary.chunk_indexes.len() > 2);
    assert!(summary.chunk_indexes.iter().all(|chunk| chunk.uncompressed_size <= 1 << 20));
    assert!(summary.channels.values().all(|channel| {
        channel.schema.as_ref().is_some_and(|schema| schema.encoding == "jsonschema")
    }));
    let messages = MessageStream::new(&bytes).unwrap();
    for (step, message) in messages.enumerate() {
        let (message, wanted) = (message.unwrap(), sample(step as u64));
        assert_eq!(&*message.data, wanted.payload);
        assert_eq!(
            (message.log_time, message.publish_time),
            (wanted.time_unix_ns, wanted.time_unix_ns)
        );
        assert_eq!(message.sequence, wanted.sequence);
        assert_eq!(message.channel.message_encoding, "json");
    }
}

#[test]
fn of_a_file_cut_anywhere_everything_before_the_last_sync_is_read() {
    let directory = tempfile::tempdir().unwrap();
    let (whole, cut) = (directory.path().join("a.mcap"), directory.path().join("b.mcap"));
    let synced = write(&whole, 60, 7);
    let bytes = fs::read(&whole).unwrap();
    let around = |(at, _): &(u64, u64)| at.saturating_sub(12)..at + 12;
    let lengths = (0..bytes.len() as u64).step_by(23).chain(synced.iter().flat_map(around));
    for length in lengths.filter(|length| *length < bytes.len() as u64) {
        let length = length as usize;
        fs::write(&cut, &bytes[..length]).unwrap();
        let recording = Recording::open(&cut).unwrap();
        let mut messages = recording.messages().unwrap();
        let found: Vec<Recorded> = messages.by_ref().map(Result::unwrap).collect();
        let on_disk =
            synced.iter().rfind(|(at, _)| *at <= length as u64).map_or(0, |(_, had)| *had);
        assert!(found.len() as u64 >= on_disk, "{length} bytes: {} of {on_disk}", found.len());
        assert!(found.iter().enumerate().all(|(step, found)| *found == sample(step as u64)));
        // The footer ends with the file's last eight bytes, which say nothing more.
        let ending = messages.ending().unwrap();
        assert_eq!(ending == Ending::Finished, length + 8 >= bytes.len(), "{length}: {ending}");
    }
}

#[test]
fn a_changed_byte_is_noticed_and_no_message_is_another_one() {
    let directory = tempfile::tempdir().unwrap();
    let (whole, changed) = (directory.path().join("a.mcap"), directory.path().join("b.mcap"));
    write(&whole, 60, 7);
    let original = fs::read(&whole).unwrap();
    // The magic at the end says nothing.
    for at in (0..original.len() - 8).step_by(17) {
        let mut bytes = original.clone();
        bytes[at] ^= 1 << (at % 8);
        fs::write(&changed, &bytes).unwrap();
        let Ok(recording) = Recording::open(&changed) else { continue };
        let mut messages = recording.messages().unwrap();
        let (found, wrong): (Vec<_>, Vec<_>) = messages.by_ref().partition(Result::is_ok);
        let is_finished = messages.ending() == Some(Ending::Finished);
        assert!(!wrong.is_empty() || !is_finished, "byte {at} of {}", original.len());
        for message in found.into_iter().map(Result::unwrap) {
            let wanted = sample(u64::from(message.sequence));
            assert_eq!(message.payload, wanted.payload, "byte {at}");
        }
    }
}

#[test]
fn what_is_said_about_a_recording_is_read_without_its_messages() {
    let directory = tempfile::tempdir().unwrap();
    let file = directory.path().join("a.mcap");
    let mut writer = Writer::create(&file).unwrap();
    let values = BTreeMap::from([("software".to_owned(), "1.0".to_owned())]);
    let metadata = Metadata { name: "module/module1".to_owned(), values };
    writer.write(&sample(0)).unwrap();
    writer.note(metadata.clone()).unwrap();
    writer.write(&sample(1)).unwrap();
    writer.sync().unwrap();
    let said = || Recording::open(&file).unwrap().metadata().unwrap();
    assert_eq!(said(), std::slice::from_ref(&metadata));
    writer.finish().unwrap();
    assert_eq!(said(), [metadata]);
    assert_eq!(read(&file).len(), 2);
}

#[test]
fn a_chunk_that_claims_to_be_longer_than_any_is_refused() {
    let directory = tempfile::tempdir().unwrap();
    let file = directory.path().join("a.mcap");
    let synced = write(&file, 60, 20);
    let mut bytes = fs::read(&file).unwrap();
    let at = synced[1].0 as usize;
    let (claimed, checksum) = (at + 9 + 16, at + 9 + 24);
    bytes[claimed..claimed + 8].copy_from_slice(&10_000_000_000_u64.to_le_bytes());
    bytes[checksum..checksum + 4].fill(0);
    fs::write(&file, &bytes).unwrap();
    let recording = Recording::open(&file).unwrap();
    let (found, wrong): (Vec<_>, Vec<_>) = recording.messages().unwrap().partition(Result::is_ok);
    assert_eq!(found.len(), 40);
    let said = wrong[0].as_ref().unwrap_err().to_string();
    let wanted =
        format!("byte {at}: a chunk of 10000000000 bytes is too long: at most 67108864 bytes");
    assert!(said.contains(&wanted), "{said}");
}

#[test]
fn a_chunk_that_lies_about_any_length_costs_at_most_what_is_not_told_apart_from_it() {
    let directory = tempfile::tempdir().unwrap();
    let file = directory.path().join("a.mcap");
    let synced = write(&file, 60, 20);
    let whole = fs::read(&file).unwrap();
    let all: Vec<Recorded> = (0..60).map(sample).collect();
    let at = synced[1].0 as usize;
    // The record, what it unpacks to, the name of the compression, what is packed.
    for (place, length) in [(1, 8), (9 + 16, 8), (9 + 28, 4), (9 + 36, 8)] {
        let mut written = [0; 8];
        written[..length].copy_from_slice(&whole[at + place..at + place + length]);
        let written = u64::from_le_bytes(written);
        for lie in [0, 1, written - 1, written + 1, 1 << 31, 1 << 40, 1 << 62, u64::MAX] {
            let mut bytes = whole.clone();
            bytes[at + place..at + place + length].copy_from_slice(&lie.to_le_bytes()[..length]);
            fs::write(&file, &bytes).unwrap();
            let recording = Recording::open(&file).unwrap();
            let mut messages = recording.messages().unwrap();
            let (found, wrong): (Vec<_>, Vec<_>) = messages.by_ref().partition(Result::is_ok);
            let found: Vec<Recorded> = found.into_iter().map(Result::unwrap).collect();
            assert!(found.iter().all(|message| all.contains(message)), "{place}: {lie}");
            assert!(found.len() >= 20 && found.len() < 60, "{place}: {lie}: {}", found.len());
            let is_finished = matches!(messages.ending(), Some(Ending::Finished));
            assert!(!wrong.is_empty() || !is_finished, "{place}: {lie}");
        }
    }
}

#[test]
fn a_small_file_of_very_many_messages_is_not_read_to_its_end() {
    let directory = tempfile::tempdir().unwrap();
    let [file, copy] = ["a.mcap", "b.mcap"].map(|name| directory.path().join(name));
    // Indexes of messages would make it longer.
    let options = WriteOptions::new().emit_message_indexes(false);
    let mut writer = options.create(BufWriter::new(File::create(&file).unwrap())).unwrap();
    let channel_id = writer.add_channel(0, "t", "json", &BTreeMap::new()).unwrap();
    let header = MessageHeader { channel_id, sequence: 0, log_time: 0, publish_time: 0 };
    let count = 300_000;
    (0..count).for_each(|_| writer.write_to_known_channel(&header, &[]).unwrap());
    writer.finish().unwrap();
    drop(writer);
    let recording = Recording::open(&file).unwrap();
    let (found, wrong): (Vec<_>, Vec<_>) = recording.messages().unwrap().partition(Result::is_ok);
    assert!((200_000..290_000).contains(&found.len()), "{}", found.len());
    let said: Vec<String> = wrong.into_iter().map(|one| one.unwrap_err().to_string()).collect();
    assert!(said.len() == 1 && said[0].contains("unpacks to more than 256 times"), "{said:?}");
    // Copying keeps nothing.
    assert_eq!(recording::recover(&file, &copy).unwrap().messages, count);
}

#[test]
fn a_small_file_that_unpacks_to_very_much_is_not_copied_to_its_end() {
    let directory = tempfile::tempdir().unwrap();
    let [file, copy] = ["a.mcap", "b.mcap"].map(|name| directory.path().join(name));
    let options = WriteOptions::new().emit_message_indexes(false).chunk_size(Some(32 << 20));
    let mut writer = options.create(BufWriter::new(File::create(&file).unwrap())).unwrap();
    let channel_id = writer.add_channel(0, "t", "json", &BTreeMap::new()).unwrap();
    let header = MessageHeader { channel_id, sequence: 0, log_time: 0, publish_time: 0 };
    for payload in [0, 1 << 20] {
        let count = (200 << 20) / (payload + 31);
        let payload = vec![0; payload];
        (0..count).for_each(|_| writer.write_to_known_channel(&header, &payload).unwrap());
    }
    writer.finish().unwrap();
    drop(writer);
    let length = fs::metadata(&file).unwrap().len();
    let recovered = recording::recover(&file, &copy).unwrap();
    let most = (length * 256).max(16 << 20) / 31;
    assert!((100_000..=most).contains(&recovered.messages), "{} of {length}", recovered.messages);
    let said = &recovered.problems;
    assert!(said.len() == 1 && said[0].contains("unpacks to more than 256 times"), "{said:?}");
    assert_eq!(recovered.ending, Ending::Unfinished);
}

#[test]
fn what_is_no_recording_is_refused() {
    let directory = tempfile::tempdir().unwrap();
    let file = directory.path().join("a.mcap");
    fs::write(&file, "step,g1\n0,1.5\n").unwrap();
    let error = Recording::open(&file).unwrap_err().to_string();
    assert!(error.contains("a.mcap: not an MCAP file"), "{error}");
    assert!(Recording::open(&directory.path().join("none.mcap")).is_err());
    write(&directory.path().join("c.mcap"), 1, 1);
    assert!(Writer::create(&directory.path().join("c.mcap")).is_err(), "nothing is overwritten");
}

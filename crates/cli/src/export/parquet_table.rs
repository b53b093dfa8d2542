//! A module's table as Parquet.

use std::fs::File;
use std::io;
use std::path::Path;
use std::sync::Arc;

use ::replay::TableRow;
use parquet::basic::{Compression, Repetition, Type as Physical, ZstdLevel};
use parquet::data_type::{DoubleType, Int64Type};
use parquet::file::properties::WriterProperties;
use parquet::file::writer::{SerializedFileWriter, SerializedRowGroupWriter};
use parquet::schema::types::{Type, TypePtr};

/// Rows buffered in memory and written together.
const GROUP: usize = 65_536;

/// Writes a table: step and time of publication \[ns since 1970\] as integers, the other values by name.
pub(super) fn write(
    file: &Path,
    names: &[String],
    rows: impl Iterator<Item = TableRow>,
) -> io::Result<()> {
    let properties = WriterProperties::builder()
        .set_compression(Compression::ZSTD(ZstdLevel::default()))
        .build();
    let schema = schema(names).map_err(io::Error::other)?;
    let mut out = SerializedFileWriter::new(File::create(file)?, schema, Arc::new(properties))?;
    let mut rows = rows.peekable();
    while rows.peek().is_some() {
        let group: Vec<TableRow> = rows.by_ref().take(GROUP).collect();
        let mut writer = out.next_row_group()?;
        whole_numbers(&mut writer, group.iter().map(|row| row.step))?;
        whole_numbers(&mut writer, group.iter().map(|row| row.published_ns))?;
        for place in 0..names.len() {
            values(&mut writer, group.iter().map(|row| row.values[place]))?;
        }
        writer.close()?;
    }
    out.close()?;
    Ok(())
}

fn schema(names: &[String]) -> parquet::errors::Result<TypePtr> {
    let column = |name: &str, kind, repetition| {
        let column = Type::primitive_type_builder(name, kind).with_repetition(repetition).build();
        Ok::<_, parquet::errors::ParquetError>(Arc::new(column?))
    };
    let whole = ["step", "published_ns"];
    let whole = whole.iter().map(|name| column(name, Physical::INT64, Repetition::REQUIRED));
    let values = names.iter().map(|name| column(name, Physical::DOUBLE, Repetition::OPTIONAL));
    let columns = whole.chain(values).collect::<Result<Vec<_>, _>>()?;
    Ok(Arc::new(Type::group_type_builder("samples").with_fields(columns).build()?))
}

fn whole_numbers(
    group: &mut SerializedRowGroupWriter<'_, File>,
    column: impl Iterator<Item = u64>,
) -> parquet::errors::Result<()> {
    let Some(mut writer) = group.next_column()? else { return Ok(()) };
    // Times and steps are far below 2⁶³.
    let column: Vec<i64> = column.map(|value| i64::try_from(value).unwrap_or(i64::MAX)).collect();
    writer.typed::<Int64Type>().write_batch(&column, None, None)?;
    writer.close()
}

/// Replaces NaN by null.
fn values(
    group: &mut SerializedRowGroupWriter<'_, File>,
    column: impl Iterator<Item = f64>,
) -> parquet::errors::Result<()> {
    let Some(mut writer) = group.next_column()? else { return Ok(()) };
    let column: Vec<f64> = column.collect();
    let there: Vec<i16> = column.iter().map(|value| i16::from(value.is_finite())).collect();
    let finite: Vec<f64> = column.into_iter().filter(|value| value.is_finite()).collect();
    writer.typed::<DoubleType>().write_batch(&finite, Some(&there), None)?;
    writer.close()
}

#[cfg(test)]
mod tests {
    use super::*;
    use parquet::file::reader::{FileReader, SerializedFileReader};
    use parquet::record::Field;

    #[test]
    fn every_value_is_read_back_and_what_is_missing_is_null() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("table.parquet");
        let names = ["time_s", "module1/sensor/g1/elongation_m"].map(str::to_owned);
        let last = GROUP as u64 + 2;
        let row = |step: u64| TableRow {
            step,
            published_ns: u64::MAX / 4 + step,
            values: vec![step as f64 / 3.0, if step == 5 { f64::NAN } else { 0.1 + step as f64 }],
        };
        write(&file, &names, (0..=last).map(row)).unwrap();
        let reader = SerializedFileReader::new(File::open(&file).unwrap()).unwrap();
        assert_eq!(reader.num_row_groups(), 2);
        let rows: Vec<Vec<(String, Field)>> =
            reader.get_row_iter(None).unwrap().map(|row| row.unwrap().into_columns()).collect();
        assert_eq!(rows.len() as u64, last + 1);
        let heading: Vec<&str> = rows[0].iter().map(|(name, _)| name.as_str()).collect();
        assert_eq!(heading, ["step", "published_ns", "time_s", "module1/sensor/g1/elongation_m"]);
        for step in [0, 4, last] {
            let read: Vec<Field> =
                rows[step as usize].iter().map(|(_, field)| field.clone()).collect();
            let TableRow { published_ns, values, .. } = row(step);
            let expected = [
                Field::Long(step as i64),
                Field::Long(published_ns as i64),
                Field::Double(values[0]),
                Field::Double(values[1]),
            ];
            assert_eq!(read, expected);
        }
        assert_eq!(rows[5][3].1, Field::Null);
    }
}

//! Rows as Parquet: the columns of the CSV file, doubles and text, each with its unit and description in the metadata.

use std::path::Path;
use std::sync::Arc;

use parquet::basic::{ConvertedType, LogicalType, Repetition, Type as Physical};
use parquet::data_type::{ByteArray, ByteArrayType, DoubleType};
use parquet::errors::ParquetError;
use parquet::file::metadata::KeyValue;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::types::Type;

use crate::atomic;

use super::column::{Cell, Column};
use super::error::ExportError;
use super::lines::Fill;
use super::rows::{Row, Rows};

/// Rows that are in memory at once: some ten megabytes.
const GROUP: usize = 1 << 15;

/// Writes the rows of a recording and says how many there are.
///
/// # Errors
/// [`ExportError`] where the recording cannot be read, or the file not be written; then it is left as it was.
pub fn write_parquet(recording: &Path, output: &Path) -> Result<u64, ExportError> {
    let mut rows = Rows::open(recording)?;
    let columns = rows.columns().to_vec();
    let mut count = 0;
    atomic::write_with(output, |file| {
        let schema = Arc::new(schema(&columns).map_err(io)?);
        let properties = WriterProperties::builder()
            .set_created_by(format!("tonus {}", env!("CARGO_PKG_VERSION")))
            .set_key_value_metadata(Some(metadata(&columns)))
            .build();
        let mut writer =
            SerializedFileWriter::new(file, schema, Arc::new(properties)).map_err(io)?;
        loop {
            let group: Vec<Row> = rows
                .by_ref()
                .take(GROUP)
                .collect::<Result<_, _>>()
                .map_err(Fill::Read)?;
            if group.is_empty() {
                break;
            }
            count += group.len() as u64;
            write_group(&mut writer, &columns, &group).map_err(io)?;
        }
        writer.close().map_err(io)?;
        Ok(())
    })
    .map_err(|error| match error {
        Fill::Read(error) => error.into(),
        Fill::Write(source) => ExportError::Write {
            path: output.to_owned(),
            source,
        },
    })?;
    Ok(count)
}

fn io(error: ParquetError) -> Fill {
    Fill::Write(std::io::Error::other(error))
}

fn schema(columns: &[Column]) -> Result<Type, ParquetError> {
    let mut fields = Vec::with_capacity(columns.len());
    for column in columns {
        let field = if column.text {
            Type::primitive_type_builder(&column.name, Physical::BYTE_ARRAY)
                .with_converted_type(ConvertedType::UTF8)
                .with_logical_type(Some(LogicalType::String))
        } else {
            Type::primitive_type_builder(&column.name, Physical::DOUBLE)
        };
        let field = field.with_repetition(Repetition::OPTIONAL).build()?;
        fields.push(Arc::new(field));
    }
    Type::group_type_builder("rows").with_fields(fields).build()
}

/// `unit:NAME` and `description:NAME` for each column.
fn metadata(columns: &[Column]) -> Vec<KeyValue> {
    let pairs = columns.iter().flat_map(|column| {
        [
            KeyValue::new(format!("unit:{}", column.name), column.unit.to_owned()),
            KeyValue::new(
                format!("description:{}", column.name),
                column.description.to_owned(),
            ),
        ]
    });
    pairs.collect()
}

fn write_group<W: std::io::Write + Send>(
    writer: &mut SerializedFileWriter<W>,
    columns: &[Column],
    group: &[Row],
) -> Result<(), ParquetError> {
    let mut row_group = writer.next_row_group()?;
    for (place, column) in columns.iter().enumerate() {
        let cells = group.iter().filter_map(|row| row.get(place));
        let levels: Vec<i16> = (cells.clone())
            .map(|cell| i16::from(*cell != Cell::Missing))
            .collect();
        let Some(mut into) = row_group.next_column()? else {
            break;
        };
        if column.text {
            let texts: Vec<ByteArray> = cells
                .filter_map(|cell| match cell {
                    Cell::Text(text) => Some(ByteArray::from(text.as_str())),
                    _ => None,
                })
                .collect();
            into.typed::<ByteArrayType>()
                .write_batch(&texts, Some(&levels), None)?;
        } else {
            let numbers: Vec<f64> = cells
                .filter_map(|cell| match cell {
                    Cell::Number(number) => Some(*number),
                    _ => None,
                })
                .collect();
            into.typed::<DoubleType>()
                .write_batch(&numbers, Some(&levels), None)?;
        }
        into.close()?;
    }
    row_group.close()?;
    Ok(())
}

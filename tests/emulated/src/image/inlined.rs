//! Where functions went that the compiler put into their callers: the debug information knows.

use gimli::{AttributeValue, DebuggingInformationEntry, Dwarf, EndianSlice, LittleEndian, Unit};
use goblin::elf::Elf;

use super::Function;

type Slice<'a> = EndianSlice<'a, LittleEndian>;
type Entry<'abbreviations, 'unit, 'a> = DebuggingInformationEntry<'abbreviations, 'unit, Slice<'a>>;

/// Every run of addresses that an inlined function was put at; its name is the function's.
pub(super) fn functions(elf: &Elf<'_>, bytes: &[u8]) -> Result<Vec<Function>, gimli::Error> {
    let section = |id: gimli::SectionId| {
        let header = elf
            .section_headers
            .iter()
            .find(|header| elf.shdr_strtab.get_at(header.sh_name) == Some(id.name()));
        let range = header.and_then(goblin::elf::SectionHeader::file_range);
        let content = range.and_then(|range| bytes.get(range)).unwrap_or_default();
        Ok::<_, gimli::Error>(EndianSlice::new(content, LittleEndian))
    };
    let dwarf = Dwarf::load(section)?;
    let mut units = Vec::new();
    let mut headers = dwarf.units();
    while let Some(header) = headers.next()? {
        units.push(dwarf.unit(header)?);
    }
    let mut found = Vec::new();
    for unit in &units {
        let mut entries = unit.entries();
        while let Some((_, entry)) = entries.next_dfs()? {
            if entry.tag() != gimli::DW_TAG_inlined_subroutine {
                continue;
            }
            let Some(name) = name(&dwarf, &units, unit, entry)? else {
                continue;
            };
            let mut ranges = dwarf.die_ranges(unit, entry)?;
            while let Some(range) = ranges.next()? {
                found.push(Function {
                    start: range.begin as u32,
                    end: range.end as u32,
                    name: name.clone(),
                });
            }
        }
    }
    Ok(found)
}

/// The mangled name of the function that an entry is a copy of.
fn name(
    dwarf: &Dwarf<Slice<'_>>,
    units: &[Unit<Slice<'_>>],
    unit: &Unit<Slice<'_>>,
    entry: &Entry<'_, '_, '_>,
) -> Result<Option<String>, gimli::Error> {
    if let Some(value) = entry.attr_value(gimli::DW_AT_linkage_name)? {
        let name = dwarf.attr_string(unit, value)?;
        return Ok(Some(name.to_string_lossy().into_owned()));
    }
    for link in [gimli::DW_AT_abstract_origin, gimli::DW_AT_specification] {
        match entry.attr_value(link)? {
            Some(AttributeValue::UnitRef(offset)) => {
                return name(dwarf, units, unit, &unit.entry(offset)?);
            }
            Some(AttributeValue::DebugInfoRef(offset)) => {
                let holder = units.iter().find_map(|unit| {
                    let offset = offset.to_unit_offset(&unit.header)?;
                    Some((unit, offset))
                });
                if let Some((unit, offset)) = holder {
                    return name(dwarf, units, unit, &unit.entry(offset)?);
                }
            }
            _ => {}
        }
    }
    Ok(None)
}

//! EDF+ and its 24-bit sister BDF+: headers and data records by the book.
//!
//! Kemp and Olivan, *European data format 'plus' (EDF+)*, Clinical Neurophysiology 114 (2003);
//! <https://www.edfplus.info/specs/edfplus.html>. One file is contiguous ("EDF+C"): readers in wide use refuse
//! discontinuous ones. What is missing is filled, and an annotation says so.

use std::io::{self, Write};

/// Digital values of a sample: 16 bits in EDF+, 24 in BDF+.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Width {
    Edf,
    Bdf,
}

impl Width {
    const fn bytes(self) -> usize {
        match self {
            Self::Edf => 2,
            Self::Bdf => 3,
        }
    }
}

/// A signal: microvolts are `(count - offset) * microvolts_per_count`.
#[derive(Clone, Debug, PartialEq)]
pub struct Signal<'a> {
    /// At most 16 characters.
    pub label: String,
    /// What the electrodes are.
    pub transducer: String,
    /// What was filtered before.
    pub prefilter: String,
    /// One value for each sample.
    pub counts: &'a [i32],
    /// Microvolts of one count.
    pub microvolts_per_count: f64,
    /// The count that means zero.
    pub offset: i32,
}

/// Something that is said about a time.
#[derive(Clone, Debug, PartialEq)]
pub struct Annotation {
    /// When it begins, seconds since the first sample.
    pub onset_s: f64,
    /// How long it lasts, seconds; none for an instant.
    pub duration_s: Option<f64>,
    /// What it is.
    pub text: String,
}

/// A file.
#[derive(Clone, Debug, PartialEq)]
pub struct Edf<'a> {
    /// A code for the person, without spaces.
    pub subject: String,
    /// Wall-clock time of the first sample, microseconds since 1970 in UTC.
    pub start_unix_us: u64,
    /// Samples per second of every signal.
    pub rate_hz: f64,
    /// Signals of one length.
    pub signals: Vec<Signal<'a>>,
    /// What is said.
    pub annotations: Vec<Annotation>,
}

/// A step of EDF+'s 16 bits above this costs resolution that the amplifier has: its rounding, 0.06 microvolts RMS, comes
/// near to the noise of a good electrode. Then 24 bits hold the counts as they are.
const COARSEST_STEP_UV: f64 = 0.2;

/// Physical and digital range of a signal, as the header says them.
struct Range {
    low: String,
    high: String,
    digital: [i32; 2],
    low_uv: f64,
    /// Microvolts of a digital step.
    step_uv: f64,
}

impl Edf<'_> {
    /// Microvolts of the coarsest digital step in a file of 16 bits.
    fn step_uv(&self) -> f64 {
        let steps = self.signals.iter().map(|signal| range(signal).step_uv);
        steps.fold(0.0, f64::max)
    }

    fn width(&self) -> Width {
        if self.step_uv() <= COARSEST_STEP_UV {
            Width::Edf
        } else {
            Width::Bdf
        }
    }

    /// How files of its kind are named: `edf`, or `bdf` where 16 bits would cost resolution.
    #[must_use]
    pub fn extension(&self) -> &'static str {
        match self.width() {
            Width::Edf => "edf",
            Width::Bdf => "bdf",
        }
    }

    /// Samples of each signal in a data record: one second of them, or as near as whole samples come.
    fn samples_per_record(&self) -> usize {
        (self.rate_hz.round() as usize).max(1)
    }

    /// Length of a data record, seconds.
    fn record_s(&self) -> f64 {
        self.samples_per_record() as f64 / self.rate_hz
    }

    fn samples(&self) -> usize {
        self.signals.first().map_or(0, |signal| signal.counts.len())
    }

    /// How long the file says that it is, seconds: whole data records.
    #[must_use]
    pub fn duration_s(&self) -> f64 {
        self.records() as f64 * self.record_s()
    }

    fn records(&self) -> usize {
        self.samples().div_ceil(self.samples_per_record())
    }

    /// Writes header and data records. Samples beyond the end of the signals are zero volts, and annotated.
    ///
    /// # Errors
    /// What the system says.
    pub fn write(&self, out: &mut impl Write) -> io::Result<()> {
        let width = self.width();
        let lists = self.annotation_lists();
        let longest = lists.iter().map(Vec::len).max().unwrap_or_default();
        let annotation_samples = longest.div_ceil(width.bytes()).max(8);
        let range = match width {
            Width::Edf => range,
            Width::Bdf => counts_range,
        };
        let ranges: Vec<Range> = self.signals.iter().map(range).collect();
        self.write_header(out, width, annotation_samples, &ranges)?;
        let per_record = self.samples_per_record();
        for (record, list) in lists.iter().enumerate() {
            for (signal, range) in self.signals.iter().zip(&ranges) {
                for sample in record * per_record..(record + 1) * per_record {
                    let count = signal.counts.get(sample).copied();
                    let count = count.unwrap_or(signal.offset);
                    match width {
                        Width::Edf => {
                            let digital = digital(signal, range, count);
                            out.write_all(&digital.to_le_bytes())?;
                        }
                        Width::Bdf => {
                            let [low, middle, high, _] = count.to_le_bytes();
                            out.write_all(&[low, middle, high])?;
                        }
                    }
                }
            }
            out.write_all(list)?;
            let rest = annotation_samples * width.bytes() - list.len();
            out.write_all(&vec![0; rest])?;
        }
        out.flush()
    }

    /// For each data record: when it begins, and what is said of a time within it.
    fn annotation_lists(&self) -> Vec<Vec<u8>> {
        // The header tells the time in whole seconds.
        let start_s = (self.start_unix_us % 1_000_000) as f64 * 1e-6;
        let record_s = self.record_s();
        let mut lists: Vec<Vec<u8>> = (0..self.records())
            .map(|record| {
                let onset_s = start_s + record as f64 * record_s;
                format!("+{}\x14\x14\0", time(onset_s)).into_bytes()
            })
            .collect();
        let mut said = self.annotations.clone();
        let missing_s = self.samples() as f64 / self.rate_hz;
        if self.duration_s() - missing_s > 0.5 / self.rate_hz {
            said.push(Annotation {
                onset_s: missing_s,
                duration_s: Some(self.duration_s() - missing_s),
                text: "BAD_gap after the end".to_owned(),
            });
        }
        for annotation in &said {
            let record = (annotation.onset_s.max(0.0) / record_s) as usize;
            let last = lists.len().saturating_sub(1);
            let Some(list) = lists.get_mut(record.min(last)) else {
                continue;
            };
            let onset_s = start_s + annotation.onset_s.max(0.0);
            let duration = annotation.duration_s.map(|s| format!("\x15{}", time(s)));
            let text: String = (annotation.text.chars())
                .filter(|c| !c.is_control())
                .collect();
            let line = format!(
                "+{}{}\x14{text}\x14\0",
                time(onset_s),
                duration.unwrap_or_default()
            );
            list.extend_from_slice(line.as_bytes());
        }
        lists
    }

    fn write_header(
        &self,
        out: &mut impl Write,
        width: Width,
        annotation_samples: usize,
        ranges: &[Range],
    ) -> io::Result<()> {
        let signals = self.signals.len() + 1;
        let (date, clock, long_date) = date(self.start_unix_us / 1_000_000);
        let mut head = Vec::with_capacity(256 * (signals + 1));
        match width {
            Width::Edf => ascii(&mut head, "0", 8),
            Width::Bdf => head.extend_from_slice(b"\xffBIOSEMI"),
        }
        ascii(&mut head, &format!("{} X X X", word(&self.subject)), 80);
        ascii(&mut head, &format!("Startdate {long_date} X X tonus"), 80);
        ascii(&mut head, &date, 8);
        ascii(&mut head, &clock, 8);
        ascii(&mut head, &(256 * (signals + 1)).to_string(), 8);
        let kind = match width {
            Width::Edf => "EDF+C",
            Width::Bdf => "BDF+C",
        };
        ascii(&mut head, kind, 44);
        ascii(&mut head, &self.records().to_string(), 8);
        ascii(&mut head, &fitting(self.record_s(), f64::round), 8);
        ascii(&mut head, &signals.to_string(), 4);
        let (annotations, low, high) = match width {
            Width::Edf => ("EDF Annotations", "-32768", "32767"),
            Width::Bdf => ("BDF Annotations", "-8388608", "8388607"),
        };
        let mut field = |bytes: usize, of: &dyn Fn(usize) -> String, of_annotations: &str| {
            for signal in 0..self.signals.len() {
                ascii(&mut head, &of(signal), bytes);
            }
            ascii(&mut head, of_annotations, bytes);
        };
        field(
            16,
            &|signal| self.signals[signal].label.clone(),
            annotations,
        );
        field(80, &|signal| self.signals[signal].transducer.clone(), "");
        field(8, &|_| "uV".to_owned(), "");
        field(8, &|signal| ranges[signal].low.clone(), "-1");
        field(8, &|signal| ranges[signal].high.clone(), "1");
        field(8, &|signal| ranges[signal].digital[0].to_string(), low);
        field(8, &|signal| ranges[signal].digital[1].to_string(), high);
        field(80, &|signal| self.signals[signal].prefilter.clone(), "");
        let per_record = self.samples_per_record().to_string();
        field(8, &|_| per_record.clone(), &annotation_samples.to_string());
        field(32, &|_| String::new(), "");
        out.write_all(&head)
    }
}

/// What 16 bits span: the signal's own extremes and zero, as eight characters can say them.
fn range(signal: &Signal<'_>) -> Range {
    let uv =
        |count: i32| (f64::from(count) - f64::from(signal.offset)) * signal.microvolts_per_count;
    let extremes = (signal.counts.iter().min(), signal.counts.iter().max());
    let (low, high) = match extremes {
        (Some(&low), Some(&high)) => (uv(low).min(0.0), uv(high).max(0.0)),
        _ => (0.0, 0.0),
    };
    // A range of nothing is none.
    let high = if high - low < 1.0 { low + 1.0 } else { high };
    let (low, high) = (fitting(low, f64::floor), fitting(high, f64::ceil));
    let number = |text: &str| text.parse().unwrap_or_default();
    let (low_uv, high_uv): (f64, f64) = (number(&low), number(&high));
    Range {
        low,
        high,
        digital: [-32_768, 32_767],
        low_uv,
        step_uv: (high_uv - low_uv) / 65_535.0,
    }
}

/// What 24 bits span: counts as they are, from the least to the greatest.
fn counts_range(signal: &Signal<'_>) -> Range {
    let counts = || signal.counts.iter();
    let low = counts().fold(signal.offset, |low, &count| low.min(count));
    let high = counts().fold(low + 1, |high, &count| high.max(count));
    let uv =
        |count: i32| (f64::from(count) - f64::from(signal.offset)) * signal.microvolts_per_count;
    Range {
        low: fitting(uv(low), f64::round),
        high: fitting(uv(high), f64::round),
        digital: [low, high],
        low_uv: uv(low),
        step_uv: signal.microvolts_per_count,
    }
}

fn digital(signal: &Signal<'_>, range: &Range, count: i32) -> i16 {
    let uv = (f64::from(count) - f64::from(signal.offset)) * signal.microvolts_per_count;
    let step = ((uv - range.low_uv) / range.step_uv).round();
    // From 0 to 65535, so within 16 bits.
    (step.clamp(0.0, 65_535.0) as i32 - 32_768) as i16
}

/// A field of a header: printable characters, cut or filled with spaces.
fn ascii(head: &mut Vec<u8>, text: &str, bytes: usize) {
    let printable = text.bytes().map(|byte| match byte {
        b' '..=b'~' => byte,
        _ => b'_',
    });
    head.extend(printable.chain(std::iter::repeat(b' ')).take(bytes));
}

/// The number in at most eight characters with as many decimals as fit, rounded this way.
fn fitting(value: f64, round: fn(f64) -> f64) -> String {
    for decimals in (0..=6).rev() {
        let scale = 10_f64.powi(decimals);
        let rounded = round(value * scale) / scale;
        let text = format!("{rounded:.*}", decimals as usize);
        if text.len() <= 8 {
            return text;
        }
    }
    // Beyond ten volts: no electrode does that.
    if value < 0.0 { "-9999999" } else { "99999999" }.to_owned()
}

/// Seconds in a list of annotations: a tenth of a microsecond is the finest that readers take.
fn time(seconds: f64) -> String {
    let text = format!("{seconds:.6}");
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}

/// Without spaces, which divide the fields of the subject.
fn word(text: &str) -> String {
    let word: String = (text.chars())
        .map(|c| if c.is_ascii_graphic() { c } else { '_' })
        .collect();
    if word.is_empty() {
        "X".to_owned()
    } else {
        word
    }
}

/// Date and time in UTC: `26.11.26`, `19.02.54`, `26-NOV-2026`.
fn date(unix_s: u64) -> (String, String, String) {
    const MONTHS: [&str; 12] = [
        "JAN", "FEB", "MAR", "APR", "MAY", "JUN", "JUL", "AUG", "SEP", "OCT", "NOV", "DEC",
    ];
    let second = unix_s % 86_400;
    let (year, month, day) = civil(unix_s / 86_400);
    let name = MONTHS[month as usize - 1];
    (
        format!("{day:02}.{month:02}.{:02}", year % 100),
        format!(
            "{:02}.{:02}.{:02}",
            second / 3600,
            second / 60 % 60,
            second % 60
        ),
        format!("{day:02}-{name}-{year}"),
    )
}

/// Year, month and day of the Gregorian calendar, from days since 1970: Hinnant's `civil_from_days`, whose years begin
/// in March.
pub(super) fn civil(days: u64) -> (u64, u64, u64) {
    let shifted = days + 719_468;
    let (era, day_of_era) = (shifted / 146_097, shifted % 146_097);
    let year_of_era =
        (day_of_era - day_of_era / 1460 + day_of_era / 36_524 - day_of_era / 146_096) / 365;
    let day_of_year = day_of_era - (365 * year_of_era + year_of_era / 4 - year_of_era / 100);
    let month_from_march = (5 * day_of_year + 2) / 153;
    let day = day_of_year - (153 * month_from_march + 2) / 5 + 1;
    let month = (month_from_march + 2) % 12 + 1;
    (era * 400 + year_of_era + u64::from(month < 3), month, day)
}

#[cfg(test)]
mod tests;

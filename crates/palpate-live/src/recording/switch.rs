use super::head::Subject;
use super::recorder::{Recorder, RecordingStatus};
use super::{EXTENSION, Head, RecordingError};
use crate::input::Input;
use crate::session::Estimation;
use crate::sink::{Batch, Sink};
use palpate_estimators::estimator::Locator;
use std::path::{Path, PathBuf};
use std::sync::mpsc::SyncSender;
use std::sync::{Arc, Mutex, PoisonError};

/// Sink that starts and ends recordings; clones share their state.
#[derive(Clone, Debug)]
pub struct RecordingSwitch {
    subject: Arc<Subject>,
    reports: SyncSender<Input>,
    recorder: Arc<Mutex<Option<Recorder>>>,
}

impl RecordingSwitch {
    /// Switch; `reports` receives problems.
    ///
    /// # Errors
    /// [`RecordingError::Encode`].
    pub fn new(
        locator: &Locator,
        estimation: Estimation,
        source: &str,
        reports: SyncSender<Input>,
    ) -> Result<Self, RecordingError> {
        let subject = Arc::new(Subject::new(locator, estimation, source)?);
        Ok(Self { subject, reports, recorder: Arc::default() })
    }

    /// Head of the recordings.
    pub fn head(&self) -> &Head {
        &self.subject.head
    }

    /// Begins a recording in a new file.
    ///
    /// # Errors
    /// An active recording, or an existing or unwritable file.
    pub fn begin(&self, path: &Path) -> Result<RecordingStatus, RecordingError> {
        let mut recorder = self.recorder();
        if let Some(recorder) = &*recorder {
            return Err(RecordingError::GoesOn { name: recorder.status().name });
        }
        let begun = Recorder::begin(path, Arc::clone(&self.subject), self.reports.clone())?;
        let status = begun.status();
        *recorder = Some(begun);
        Ok(status)
    }

    /// Begins a recording with a unique name in a folder, which is created.
    ///
    /// # Errors
    /// An invalid name, and those of [`Self::begin`].
    pub fn begin_in(
        &self,
        folder: &Path,
        name: Option<&str>,
        unix_s: u64,
    ) -> Result<RecordingStatus, RecordingError> {
        let name = match name {
            Some(name) => check_name(name)?.trim_end_matches(".mcap").to_owned(),
            None => utc(unix_s),
        };
        std::fs::create_dir_all(folder).map_err(|error| RecordingError::File {
            verb: "make the folder",
            path: folder.display().to_string(),
            error,
        })?;
        let mut number = 1;
        loop {
            let number_text = if number == 1 { String::new() } else { format!("-{number}") };
            let path: PathBuf = folder.join(format!("{name}{number_text}.{EXTENSION}"));
            match self.begin(&path) {
                Err(RecordingError::Exists { .. }) if number < 1000 => number += 1,
                result => return result,
            }
        }
    }

    /// Ends the recording, and waits for its file.
    pub fn end(&self) -> Option<RecordingStatus> {
        // The lock is released before the wait, so that the session continues.
        let recorder = self.recorder().take();
        recorder.map(Recorder::finish)
    }

    /// Status of the active recording.
    pub fn status(&self) -> Option<RecordingStatus> {
        self.recorder().as_ref().map(Recorder::status)
    }

    fn recorder(&self) -> std::sync::MutexGuard<'_, Option<Recorder>> {
        self.recorder.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Sink for RecordingSwitch {
    fn batch(&mut self, batch: &Arc<Batch>) {
        if let Some(recorder) = &mut *self.recorder() {
            recorder.batch(batch);
        }
    }
}

/// Checks that an untrusted name stays in its folder.
///
/// # Errors
/// [`RecordingError::Name`].
pub fn check_name(name: &str) -> Result<&str, RecordingError> {
    let is_letter = |letter: char| letter.is_ascii_alphanumeric() || "._-".contains(letter);
    let is_name =
        !name.is_empty() && name.len() <= 100 && !name.starts_with('.') && name.chars().all(is_letter);
    if is_name { Ok(name) } else { Err(RecordingError::Name { name: name.to_owned() }) }
}

/// Time such as `2026-11-24T20-14-24Z`.
fn utc(unix_s: u64) -> String {
    let (days, second) = (unix_s / 86_400, unix_s % 86_400);
    // Civil date of a day since 1970-01-01, in eras of 400 years that begin in March.
    let z = days + 719_468;
    let (era, day_of_era) = (z / 146_097, z % 146_097);
    let year_of_era = (day_of_era - day_of_era / 1460 + day_of_era / 36_524 - day_of_era / 146_096) / 365;
    let day_of_year = day_of_era - (365 * year_of_era + year_of_era / 4 - year_of_era / 100);
    let shifted = (5 * day_of_year + 2) / 153;
    let day = day_of_year - (153 * shifted + 2) / 5 + 1;
    let month = if shifted < 10 { shifted + 3 } else { shifted - 9 };
    let year = year_of_era + 400 * era + u64::from(month <= 2);
    format!("{year:04}-{month:02}-{day:02}T{:02}-{:02}-{:02}Z", second / 3600, second / 60 % 60, second % 60)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_contain_the_time() {
        assert_eq!(utc(0), "1970-01-01T00-00-00Z");
        // The leap day of a year divisible by 400, and the last second of a year.
        assert_eq!(utc(951_782_400), "2000-02-29T00-00-00Z");
        assert_eq!(utc(1_798_761_599), "2026-12-31T23-59-59Z");
    }

    #[test]
    fn names_stay_in_their_folder() {
        for name in ["", "..", "../a", "a/b", ".hidden", "a\\b", "a\0b", &"a".repeat(101)] {
            assert!(check_name(name).is_err(), "{name}");
        }
        assert!(check_name("first press_2.mcap").is_err());
        assert_eq!(check_name("first-press_2.mcap").unwrap(), "first-press_2.mcap");
    }
}

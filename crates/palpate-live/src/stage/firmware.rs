/// Firmware of a machine.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Firmware {
    /// Most 3-D printers.
    Marlin,
    /// Most small mills.
    Grbl,
}

/// Meaning of a line before the `ok`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum ReplyKind {
    Ok,
    Report,
    /// Restart without a position.
    Greeting,
    Unexpected,
}

impl Firmware {
    /// Name in messages.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Marlin => "Marlin",
            Self::Grbl => "GRBL",
        }
    }

    pub(super) const fn home(self) -> &'static str {
        match self {
            Self::Marlin => "G28",
            Self::Grbl => "$H",
        }
    }

    /// Command answered after all moves.
    pub(super) const fn wait(self) -> &'static str {
        match self {
            Self::Marlin => "M400",
            Self::Grbl => "G4 P0.01",
        }
    }

    /// Settings of moves: mm, mm/min, absolute positions, and first work coordinates of GRBL.
    pub(super) const fn settings(self) -> &'static [&'static str] {
        match self {
            Self::Marlin => &["G21", "G90"],
            Self::Grbl => &["G54", "G90", "G94", "G21"],
        }
    }

    /// Bytes that halt until a reset; GRBL reads them at any time.
    pub(super) const fn halt(self) -> &'static [u8] {
        match self {
            Self::Marlin => b"M112\n",
            Self::Grbl => b"!\x18",
        }
    }

    pub(super) fn classify(self, line: &str) -> ReplyKind {
        if is_ok(line) {
            return ReplyKind::Ok;
        }
        if is_greeting(line) {
            return ReplyKind::Greeting;
        }
        let is_report = match self {
            Self::Marlin => {
                line.starts_with("echo:busy: processing")
                    || line.starts_with("T:")
                    || line.starts_with("//action:notification")
                    || position_mm(line).is_some()
            }
            Self::Grbl => status(line).is_some_and(|status| matches!(status.state, "Idle" | "Run" | "Home")),
        };
        if is_report { ReplyKind::Report } else { ReplyKind::Unexpected }
    }

    /// True if `answer` quotes `command` as unknown: it arrived whole.
    pub(super) fn is_unknown_command(self, command: &str, answer: &str) -> bool {
        self == Self::Marlin && answer == format!("echo:Unknown command: \"{command}\"")
    }
}

pub(super) fn is_ok(line: &str) -> bool {
    line == "ok" || line.starts_with("ok ")
}

/// True for `start`, names of GRBL and its relatives, or causes of a reset.
fn is_greeting(line: &str) -> bool {
    let lower = line.to_ascii_lowercase();
    let words = lower.trim_start_matches("echo:").trim();
    words == "start"
        || words == "powerup"
        || words.starts_with("grbl")
        || words.starts_with("marlin")
        || (words.contains("reset") && !words.starts_with("[msg:"))
}

/// Parses Marlin's `X:1.00 Y:2.00 Z:3.00 E:0.00 Count X:80 …`.
pub(super) fn position_mm(line: &str) -> Option<[f64; 3]> {
    let words = line.strip_prefix("ok ").unwrap_or(line);
    if !words.starts_with("X:") {
        return None;
    }
    let (logical, _) = words.split_once("Count").unwrap_or((words, ""));
    let axis = |name: &str| {
        let (_, rest) = logical.split_once(name)?;
        let number = rest.split_whitespace().next()?;
        number.parse().ok().filter(|mm: &f64| mm.is_finite())
    };
    Some([axis("X:")?, axis("Y:")?, axis("Z:")?])
}

/// GRBL status `<Idle|MPos:0.000,0.000,0.000|FS:0,0|WCO:0.000,0.000,0.000>`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Status<'a> {
    pub state: &'a str,
    /// True after the deceleration.
    pub is_held: bool,
    pub machine_mm: Option<[f64; 3]>,
    pub work_mm: Option<[f64; 3]>,
    /// Origin of the work coordinates.
    pub offset_mm: Option<[f64; 3]>,
}

pub(super) fn status(line: &str) -> Option<Status<'_>> {
    let inner = line.strip_prefix('<')?.strip_suffix('>')?;
    let mut fields = inner.split('|');
    let state = fields.next()?;
    let mut status = Status {
        state: state.split(':').next().unwrap_or(state),
        is_held: state == "Hold:0",
        machine_mm: None,
        work_mm: None,
        offset_mm: None,
    };
    for field in fields {
        let (name, values) = field.split_once(':').unwrap_or((field, ""));
        match name {
            "MPos" => status.machine_mm = three(values),
            "WPos" => status.work_mm = three(values),
            "WCO" => status.offset_mm = three(values),
            _ => {}
        }
    }
    Some(status)
}

fn three(values: &str) -> Option<[f64; 3]> {
    let mut numbers = values.split(',').map(|value| value.parse().ok().filter(|mm: &f64| mm.is_finite()));
    Some([numbers.next()??, numbers.next()??, numbers.next()??])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reads_positions_of_both_dialects() {
        let line = "X:62.50 Y:40.00 Z:-0.25 E:0.00 Count X:5000 Y:3200 Z:-100";
        assert_eq!(position_mm(line), Some([62.5, 40.0, -0.25]));
        assert_eq!(position_mm("ok X:1 Y:2 Z:3"), Some([1.0, 2.0, 3.0]));
        for other in ["X:1.00 Y:2.00", "X:nan Y:0 Z:0", "T:21.5 /0.0", "X:", ""] {
            assert_eq!(position_mm(other), None, "{other}");
        }
        let status = status("<Hold:0|MPos:1.000,-2.500,3.000|FS:0,0|WCO:0.000,0.000,10.000>").unwrap();
        assert_eq!((status.state, status.is_held), ("Hold", true));
        assert_eq!((status.machine_mm, status.work_mm), (Some([1.0, -2.5, 3.0]), None));
        assert_eq!(status.offset_mm, Some([0.0, 0.0, 10.0]));
        assert_eq!(super::status("<Idle"), None);
    }

    #[test]
    fn classifies_lines_before_an_ok() {
        use ReplyKind::{Greeting, Ok, Report, Unexpected};
        for (firmware, line, answer) in [
            (Firmware::Marlin, "ok", Ok),
            (Firmware::Marlin, "ok P15 B3", Ok),
            (Firmware::Marlin, "okay", Unexpected),
            (Firmware::Marlin, "echo:busy: processing", Report),
            (Firmware::Marlin, "echo:busy: paused for user", Unexpected),
            (Firmware::Marlin, "T:21.3 /0.0 B:20.1 /0.0 @:0", Report),
            (Firmware::Marlin, "start", Greeting),
            (Firmware::Marlin, "echo:Marlin 2.1.2", Greeting),
            (Firmware::Marlin, "Printer reset detected", Greeting),
            (Firmware::Marlin, "echo: External Reset", Greeting),
            (Firmware::Marlin, "echo:Home XYZ First", Unexpected),
            (Firmware::Marlin, "echo:endstops hit:  X:12.00", Unexpected),
            (Firmware::Marlin, "Resend: 1", Unexpected),
            (Firmware::Grbl, "Grbl 1.1h ['$' for help]", Greeting),
            (Firmware::Grbl, "<Run|MPos:0.000,0.000,0.000|FS:0,0>", Report),
            (Firmware::Grbl, "<Alarm|MPos:0.000,0.000,0.000|FS:0,0>", Unexpected),
            (Firmware::Grbl, "<Door:1|MPos:0.000,0.000,0.000|FS:0,0>", Unexpected),
            (Firmware::Grbl, "[MSG:Reset to continue]", Unexpected),
            (Firmware::Grbl, "ALARM:1", Unexpected),
        ] {
            assert_eq!(firmware.classify(line), answer, "{line}");
        }
    }
}

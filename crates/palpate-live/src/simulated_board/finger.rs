use palpate_mechanics::contact::{Contact, Position};
use palpate_mechanics::surface::Extent;
use palpate_rig::Rig;
use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

/// Finger with random touches, a script, or control by a stage.
#[derive(Clone, Debug)]
pub struct Finger {
    rng: Xoshiro256PlusPlus,
    extent: Extent,
    force_n: Option<f64>,
    typical_n: f64,
    touch: Touch,
    script: Option<Vec<Waypoint>>,
    /// `Some(None)` if lifted.
    set_by_stage: Option<Option<Contact>>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Waypoint {
    time_s: f64,
    contact: Option<Contact>,
}

/// Error of a line of a script.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("line {line} of the script, `{text}`: {problem}")]
pub struct ScriptError {
    /// Line, from 1.
    pub line: usize,
    /// Text.
    pub text: String,
    /// Problem.
    pub problem: &'static str,
}

#[derive(Clone, Copy, Debug)]
struct Touch {
    from: Position,
    to: Position,
    force_n: f64,
    start_s: f64,
    end_s: f64,
}

impl Finger {
    const LIFTED_S: (f64, f64) = (0.8, 2.0);
    const TOUCH_S: (f64, f64) = (1.5, 5.0);
    const PRESS_S: f64 = 0.1;
    /// Untouched share of a side.
    const MARGIN: f64 = 0.05;

    /// Finger with random touches, of the rig's force or that of its calibration rows.
    pub fn random(rig: &Rig, seed: u64) -> Self {
        let typical_n = rig.training.as_ref().and_then(|training| training.force_n).unwrap_or(1.0);
        let nowhere = Position::default();
        let touch = Touch { from: nowhere, to: nowhere, force_n: 0.0, start_s: 0.0, end_s: 0.0 };
        let mut finger = Self {
            script: None,
            set_by_stage: None,
            // This random stream is independent of that of the noise.
            rng: Xoshiro256PlusPlus::seed_from_u64(seed ^ 0xF1_46E2),
            extent: rig.setup.surface().extent(),
            force_n: rig.setup.force_n(),
            typical_n,
            touch,
        };
        finger.touch = finger.next_touch(0.0);
        finger
    }

    /// Contact at a time in seconds, which must not decrease.
    pub fn contact_at(&mut self, time_s: f64) -> Option<Contact> {
        if let Some(held) = self.set_by_stage {
            return held;
        }
        if let Some(script) = &self.script {
            return scripted(script, time_s);
        }
        while time_s >= self.touch.end_s {
            self.touch = self.next_touch(self.touch.end_s);
        }
        let Touch { from, to, force_n, start_s, end_s } = self.touch;
        if time_s < start_s {
            return None;
        }
        let share = smooth((time_s - start_s) / (end_s - start_s));
        let pressed = match self.force_n {
            // A surface with a known force is never touched with less.
            Some(_) => 1.0,
            None => smooth((time_s - start_s).min(end_s - time_s) / Self::PRESS_S),
        };
        let between = |from: f64, to: f64| from + share * (to - from);
        let position = Position { x_m: between(from.x_m, to.x_m), y_m: between(from.y_m, to.y_m) };
        Some(Contact { position, force_n: force_n * pressed.max(1e-3) })
    }

    /// Sets a script `time,x,y,force` in s, mm and N, interpolated linearly; a force of 0 lifts.
    ///
    /// # Errors
    /// An invalid line.
    pub fn with_script(mut self, text: &str) -> Result<Self, ScriptError> {
        let mut script: Vec<Waypoint> = Vec::new();
        for (i, line) in text.lines().enumerate().filter(|(_, line)| !line.trim().is_empty()) {
            let error = |problem| ScriptError { line: i + 1, text: line.trim().to_owned(), problem };
            let numbers: Option<Vec<f64>> = line
                .split(',')
                .map(|cell| cell.trim().parse().ok().filter(|x: &f64| x.is_finite()))
                .collect();
            let Some(&[time_s, x_mm, y_mm, force_n]) = numbers.as_deref() else {
                if i == 0 && line.split(',').all(|cell| cell.trim().parse::<f64>().is_err()) {
                    continue;
                }
                return Err(error("it must be four numbers: time in s, x and y in mm, force in N"));
            };
            if time_s < 0.0 || script.last().is_some_and(|last| time_s <= last.time_s) {
                return Err(error("its time must be at least 0, and after that of the line before it"));
            }
            let contact = self.contact(x_mm, y_mm, force_n).map_err(error)?;
            script.push(Waypoint { time_s, contact });
        }
        self.script = Some(script);
        Ok(self)
    }

    /// True for a command to a finger.
    pub fn is_command(line: &str) -> bool {
        matches!(line.split_whitespace().next(), Some("finger" | "lift" | "reset"))
    }

    /// Executes `finger x y force` in mm and N, `lift`, or `reset` to random touches.
    ///
    /// # Errors
    /// The problem.
    pub fn execute(&mut self, line: &str) -> Result<(), &'static str> {
        let words: Vec<&str> = line.split_whitespace().collect();
        match words.as_slice() {
            ["lift"] => self.set_by_stage = Some(None),
            ["reset"] => self.set_by_stage = None,
            ["finger", numbers @ ..] => {
                let numbers: Option<Vec<f64>> = numbers.iter().map(|word| word.parse().ok()).collect();
                let Some(&[x_mm, y_mm, force_n]) = numbers.as_deref() else {
                    return Err("`finger` needs three numbers: x and y in mm, force in N");
                };
                self.set_by_stage = Some(self.contact(x_mm, y_mm, force_n)?);
            }
            _ => return Err("commands are `finger x y force`, `lift` and `reset`"),
        }
        Ok(())
    }

    /// Typical force in newtons.
    pub fn typical_n(&self) -> f64 {
        self.force_n.unwrap_or(self.typical_n)
    }

    /// Sets the contact by a stage.
    pub fn set_contact(&mut self, contact: Option<Contact>) {
        self.set_by_stage = Some(contact);
    }

    fn contact(&self, x_mm: f64, y_mm: f64, force_n: f64) -> Result<Option<Contact>, &'static str> {
        let position = Position { x_m: x_mm * 1e-3, y_m: y_mm * 1e-3 };
        let width_m = self.extent.width_m().unwrap_or(0.0);
        let is_on =
            (0.0..=self.extent.length_m()).contains(&position.x_m) && (0.0..=width_m).contains(&position.y_m);
        match force_n {
            0.0 => Ok(None),
            _ if !(force_n > 0.0 && force_n.is_finite()) => Err("the force must be at least 0 N"),
            _ if !is_on => Err("it is off the surface"),
            _ => Ok(Some(Contact { position, force_n })),
        }
    }

    fn next_touch(&mut self, after_s: f64) -> Touch {
        let start_s = after_s + self.random_between(Self::LIFTED_S);
        let end_s = start_s + self.random_between(Self::TOUCH_S);
        let force_n = match self.force_n {
            Some(force_n) => force_n,
            None => self.typical_n * self.random_between((0.5, 1.5)),
        };
        Touch { from: self.place(), to: self.place(), force_n, start_s, end_s }
    }

    fn place(&mut self) -> Position {
        let share = (Self::MARGIN, 1.0 - Self::MARGIN);
        let x_m = self.extent.length_m() * self.random_between(share);
        let y_m = self.extent.width_m().map_or(0.0, |width_m| width_m * self.random_between(share));
        Position { x_m, y_m }
    }

    fn random_between(&mut self, (low, high): (f64, f64)) -> f64 {
        self.rng.random_range(low..high)
    }
}

fn scripted(script: &[Waypoint], time_s: f64) -> Option<Contact> {
    let next = script.partition_point(|waypoint| waypoint.time_s <= time_s);
    let last = script.get(next.checked_sub(1)?)?;
    let (Some(from), Some(Waypoint { time_s: end_s, contact: Some(to) })) = (last.contact, script.get(next))
    else {
        return last.contact;
    };
    let share = (time_s - last.time_s) / (end_s - last.time_s);
    let between = |from: f64, to: f64| from + share * (to - from);
    let position = Position {
        x_m: between(from.position.x_m, to.position.x_m),
        y_m: between(from.position.y_m, to.position.y_m),
    };
    Some(Contact { position, force_n: between(from.force_n, to.force_n) })
}

fn smooth(share: f64) -> f64 {
    let share = share.clamp(0.0, 1.0);
    share * share * (3.0 - 2.0 * share)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn finger() -> Finger {
        Finger::random(&Rig::from_toml(include_str!("../../../../examples/noisy-beam.toml")).unwrap(), 1)
    }

    #[test]
    fn a_script_is_followed_evenly_and_lifts() {
        let script = "time,x,y,force\n1,100,0,1\n3,200,0,2\n4,0,0,0\n";
        let mut finger = finger().with_script(script).unwrap();
        assert_eq!(finger.contact_at(0.5), None);
        let middle = finger.contact_at(2.0).unwrap();
        assert!((middle.position.x_m - 0.15).abs() < 1e-12 && (middle.force_n - 1.5).abs() < 1e-12);
        assert_eq!(finger.contact_at(3.5).unwrap().force_n, 2.0);
        assert_eq!(finger.contact_at(9.0), None);
    }

    #[test]
    fn lines_that_no_script_has_are_named() {
        for (script, line) in
            [("1,2,3\n", 1), ("1,0,0,1\n1,0,0,1\n", 2), ("1,1000,0,1\n", 1), ("h\n0,0,0,nan", 2)]
        {
            assert_eq!(finger().with_script(script).unwrap_err().line, line, "{script}");
        }
    }

    #[test]
    fn a_stage_moves_it() {
        let mut finger = finger();
        finger.execute("finger 120 0 2.5").unwrap();
        let contact = finger.contact_at(0.0).unwrap();
        assert!((contact.position.x_m - 0.12).abs() < 1e-12 && contact.force_n == 2.5);
        finger.execute("lift").unwrap();
        assert_eq!(finger.contact_at(0.0), None);
        assert!(
            Finger::is_command(" finger a")
                && Finger::is_command("lift")
                && !Finger::is_command("brake")
                && !Finger::is_command("")
        );
        for wrong in ["finger 1 2", "finger 999 0 1", "finger 1 0 -1", "finger a b c", "dance", ""] {
            assert!(finger.execute(wrong).is_err(), "{wrong}");
        }
        finger.execute("reset").unwrap();
        assert!((0..100).any(|tenth| finger.contact_at(f64::from(tenth) * 0.1).is_some()));
    }
}

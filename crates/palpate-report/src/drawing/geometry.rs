/// In pixels, y downward.
pub(crate) type Point = (f64, f64);

/// Upright, y downward.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Rect {
    pub left: f64,
    pub top: f64,
    pub right: f64,
    pub bottom: f64,
}

impl Rect {
    pub fn width(&self) -> f64 {
        self.right - self.left
    }

    pub fn height(&self) -> f64 {
        self.bottom - self.top
    }

    pub fn translate(&self, right: f64, down: f64) -> Rect {
        Rect {
            left: self.left + right,
            right: self.right + right,
            top: self.top + down,
            bottom: self.bottom + down,
        }
    }

    pub fn contains(&self, (x, y): Point) -> bool {
        (self.left..=self.right).contains(&x) && (self.top..=self.bottom).contains(&y)
    }

    /// Signed distances from the four edges, positive inside.
    fn insides(&self) -> [impl Fn(Point) -> f64 + use<>; 4] {
        let Rect { left, top, right, bottom } = *self;
        let half_plane =
            |normal: Point, offset: f64| move |(x, y): Point| normal.0 * x + normal.1 * y + offset;
        [
            half_plane((1.0, 0.0), -left),
            half_plane((-1.0, 0.0), right),
            half_plane((0.0, 1.0), -top),
            half_plane((0.0, -1.0), bottom),
        ]
    }

    pub fn clip_line(&self, points: &[Point]) -> Vec<Vec<Point>> {
        let mut pieces: Vec<Vec<Point>> = Vec::new();
        for ends in points.windows(2) {
            let Some((start, end)) = self.clip_segment(ends[0], ends[1]) else { continue };
            match pieces.last_mut() {
                Some(piece) if piece.last() == Some(&start) && start == ends[0] => piece.push(end),
                _ => pieces.push(vec![start, end]),
            }
        }
        pieces
    }

    /// Liang and Barsky's algorithm.
    fn clip_segment(&self, start: Point, end: Point) -> Option<(Point, Point)> {
        let (mut enter, mut leave) = (0.0_f64, 1.0_f64);
        for inside in self.insides() {
            let (at_start, at_end) = (inside(start), inside(end));
            match (at_start >= 0.0, at_end >= 0.0) {
                (true, true) => {}
                (false, false) => return None,
                (false, true) => enter = enter.max(at_start / (at_start - at_end)),
                (true, false) => leave = leave.min(at_start / (at_start - at_end)),
            }
        }
        let first = if enter > 0.0 { interpolate(start, end, enter) } else { start };
        let last = if leave < 1.0 { interpolate(start, end, leave) } else { end };
        (enter <= leave).then_some((first, last))
    }

    /// Sutherland and Hodgman's algorithm; the result may be empty.
    pub fn clip_polygon(&self, points: &[Point]) -> Vec<Point> {
        let mut clipped = points.to_vec();
        for inside in self.insides() {
            let corners = std::mem::take(&mut clipped);
            let Some(&last) = corners.last() else { break };
            let mut previous = last;
            for corner in corners {
                let (before, here) = (inside(previous), inside(corner));
                if (before >= 0.0) != (here >= 0.0) {
                    clipped.push(interpolate(previous, corner, before / (before - here)));
                }
                if here >= 0.0 {
                    clipped.push(corner);
                }
                previous = corner;
            }
        }
        clipped
    }
}

fn interpolate(start: Point, end: Point, share: f64) -> Point {
    (start.0 + share * (end.0 - start.0), start.1 + share * (end.1 - start.1))
}

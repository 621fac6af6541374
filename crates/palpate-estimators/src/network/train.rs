//! Back-propagation with momentum, for N networks side by side.
//!
//! Symbols: w weights, Δ last step, x inputs of a layer, z weighted sums, a outputs, t targets, δ = −∂E/∂z, η
//! learning rate, α momentum.
//!
//! The fused first layer saturates L1 ports and vector units. Hence Δ = w − w_before, with one store per
//! weight; weights are updated and used while in a register; patterns are looked up by permuting registers.

mod order;

use std::mem::swap;

use super::{
    Activation, BackPropagation, PresentationOrder, Topology, TrainedNetwork, TrainingOutcome, TrainingSet,
    logistic,
};
use crate::fit::{SeedList, SeedQueue};
use order::{OrderDrawer, Streams, column_len};
use palpate_numerics::simd::{InstructionSet, Kernel, LOOK_UP, Real, Simd, Vector, run_loops};
use palpate_numerics::watch::{Cancelled, Watch};

/// Floating-point width of training.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Precision {
    /// 64 bits.
    #[default]
    F64,
    /// 32 bits: twice the lanes.
    F32,
}

impl Precision {
    /// Number of networks side by side.
    pub fn lanes(self) -> usize {
        match self {
            Self::F64 => 8,
            Self::F32 => 16,
        }
    }
}

/// Training task of a group of networks.
#[derive(Clone, Copy, Debug)]
pub struct TrainingTask<'a> {
    /// Topology.
    pub topology: &'a Topology,
    /// Training patterns, from 1 to [`TrainingSet::MOST`].
    pub patterns: &'a TrainingSet,
    /// Training rule.
    pub rule: &'a BackPropagation,
}

/// Trains the queue's networks, equal in any lane and thread.
///
/// # Errors
/// [`Cancelled`], with unfinished networks discarded.
pub fn train_many(
    set: InstructionSet,
    precision: Precision,
    task: &TrainingTask,
    queue: &mut dyn SeedQueue<TrainedNetwork>,
    watch: Watch,
) -> Result<(), Cancelled> {
    set.run(Training::<false> { precision, task, queue, watch })
}

/// Trains one network, equal to [`train_many`].
///
/// # Errors
/// [`Cancelled`].
pub fn train_one(
    precision: Precision,
    task: &TrainingTask,
    seed: u64,
    watch: Watch,
) -> Result<TrainedNetwork, Cancelled> {
    let mut queue = SeedList::new([seed]);
    run_loops(Training::<true> { precision, task, queue: &mut queue, watch })?;
    let trained = queue.into_results().pop();
    Ok(trained.expect("an unwatched queue is trained to its end").1)
}

/// A single network is faster `ALONE`, without idle lanes.
struct Training<'a, const ALONE: bool> {
    precision: Precision,
    task: &'a TrainingTask<'a>,
    queue: &'a mut dyn SeedQueue<TrainedNetwork>,
    watch: Watch<'a>,
}

impl<const ALONE: bool> Kernel for Training<'_, ALONE> {
    type Output = Result<(), Cancelled>;
    const FUSED: bool = true;

    #[inline(always)]
    fn run<S: Simd>(self) -> Result<(), Cancelled> {
        let Self { precision, task, queue, watch } = self;
        if const { ALONE } {
            match precision {
                Precision::F64 => train::<S, S::Array<f64, 1>, 1>(task, queue, watch),
                Precision::F32 => train::<S, S::Array<f32, 1>, 1>(task, queue, watch),
            }
        } else {
            match precision {
                Precision::F64 => train::<S, S::F64, 8>(task, queue, watch),
                Precision::F32 => train::<S, S::F32, 16>(task, queue, watch),
            }
        }
    }
}

#[inline(always)]
fn train<S: Simd, V: Vector<N>, const N: usize>(
    task: &TrainingTask,
    queue: &mut dyn SeedQueue<TrainedNetwork>,
    watch: Watch,
) -> Result<(), Cancelled> {
    let topology = task.topology;
    let row_lens: Vec<usize> = (0..topology.layers()).map(|k| topology.row_len(k)).collect();
    // Where registers have room for the inputs of two patterns, a shape fixed at compile time saves a tenth
    // of the time; elsewhere only a fiftieth.
    if const { S::REGISTERS >= 2 * 9 } && row_lens == [9, 11] {
        train_shape::<V, N, 9, 11>(task, queue, watch)
    } else {
        train_shape::<V, N, ANY, ANY>(task, queue, watch)
    }
}

/// Row length known only at run time.
const ANY: usize = 0;

/// Row length, constant for the paper's shape, which keeps eight inputs in registers.
#[inline(always)]
fn row_len<const KNOWN: usize>(len: usize) -> usize {
    if KNOWN == ANY { len } else { KNOWN }
}

#[inline(always)]
fn train_shape<V: Vector<N>, const N: usize, const FIRST: usize, const UPPER: usize>(
    task: &TrainingTask,
    queue: &mut dyn SeedQueue<TrainedNetwork>,
    watch: Watch,
) -> Result<(), Cancelled> {
    let mut group = Group::<V, N, FIRST, UPPER>::new(task);
    for lane in 0..N {
        group.start_next(lane, queue);
    }
    group.sum_first_pattern();
    while group.is_busy() {
        watch.round()?;
        let errors = group.run_epoch();
        if group.retire(errors.to_array(), queue) {
            group.sum_first_pattern();
        }
    }
    Ok(())
}

#[derive(Clone, Copy)]
struct Occupant {
    seed: u64,
    epochs: u32,
}

struct Layer<V> {
    activation: Activation,
    row_len: usize,
    weights: Vec<V>,
    /// w of the last update.
    before: Vec<V>,
    /// z, then a, then 1 for the biases.
    outputs: Vec<V>,
    deltas: Vec<V>,
}

impl<V: Copy> Layer<V> {
    fn new(topology: &Topology, k: usize, zero: V, one: V) -> Self {
        let (weights, nodes) = (topology.rows(k) * topology.row_len(k), topology.rows(k));
        Self {
            activation: topology.activation(k),
            row_len: topology.row_len(k),
            weights: vec![zero; weights],
            before: vec![zero; weights],
            outputs: vec![one; nodes + usize::from(topology.biases)],
            deltas: vec![zero; nodes + usize::from(topology.biases)],
        }
    }
}

struct Group<'t, V: Vector<N>, const N: usize, const FIRST: usize, const UPPER: usize> {
    task: &'t TrainingTask<'t>,
    input_table: Table<V::Real>,
    target_table: Table<V::Real>,
    occupants: [Option<Occupant>; N],
    streams: Streams<N>,
    drawer: OrderDrawer,
    /// Patterns of this and the next epoch.
    order: Vec<[u32; N]>,
    next_order: Vec<[u32; N]>,
    /// x of this and the next pattern, then 1 for the biases.
    inputs: Vec<V>,
    next_inputs: Vec<V>,
    targets: Vec<V>,
    layers: Vec<Layer<V>>,
}

impl<'t, V: Vector<N>, const N: usize, const FIRST: usize, const UPPER: usize> Group<'t, V, N, FIRST, UPPER> {
    fn new(task: &'t TrainingTask<'t>) -> Self {
        let (topology, patterns) = (task.topology, task.patterns);
        let one = V::splat(V::Real::from_f64(1.0));
        let zero = V::splat(V::Real::from_f64(0.0));
        let identity: Vec<[u32; N]> = (0..patterns.count()).map(|pattern| [pattern as u32; N]).collect();
        Self {
            task,
            input_table: Table::from_rows(&patterns.input_values, patterns.inputs),
            target_table: Table::from_rows(&patterns.target_values, patterns.outputs),
            occupants: [None; N],
            streams: Streams::unseeded(),
            drawer: OrderDrawer::new(patterns.count()),
            next_order: identity.clone(),
            order: identity,
            inputs: vec![one; topology.row_len(0)],
            next_inputs: vec![one; topology.row_len(0)],
            targets: vec![zero; topology.outputs()],
            layers: (0..topology.layers()).map(|k| Layer::new(topology, k, zero, one)).collect(),
        }
    }

    fn is_busy(&self) -> bool {
        self.occupants.iter().any(Option::is_some)
    }

    fn start_next(&mut self, lane: usize, queue: &mut dyn SeedQueue<TrainedNetwork>) {
        let Some(seed) = queue.next_seed() else {
            self.occupants[lane] = None;
            return;
        };
        self.occupants[lane] = Some(Occupant { seed, epochs: 0 });
        let mut stream = Streams::seeded(seed);
        for layer in &mut self.layers {
            for (weight, before) in layer.weights.iter_mut().zip(&mut layer.before) {
                let value = V::Real::from_f64(stream.uniform(self.task.rule.initial_weights));
                set_lane(weight, lane, value);
                set_lane(before, lane, value);
            }
        }
        if self.task.rule.order == PresentationOrder::Shuffled {
            let mut picks = vec![0; self.drawer.patterns()];
            self.drawer.draw_one(&mut stream, &mut picks);
            for (row, pick) in self.order.iter_mut().zip(picks) {
                row[lane] = pick;
            }
        }
        self.streams.set(lane, &stream);
    }

    /// True where a lane has a new network.
    fn retire(&mut self, errors: [V::Real; N], queue: &mut dyn SeedQueue<TrainedNetwork>) -> bool {
        let mut replaced = false;
        for (lane, error) in errors.into_iter().enumerate() {
            let Some(occupant) = &mut self.occupants[lane] else { continue };
            occupant.epochs += 1;
            let Occupant { seed, epochs } = *occupant;
            let Some(outcome) = TrainingOutcome::after_epoch(epochs, error.to_f64(), self.task) else {
                continue;
            };
            let weights = self.layers.iter().flat_map(|layer| &layer.weights);
            let weights = weights.map(|weight| weight.to_array()[lane].to_f64()).collect();
            queue.fitted(seed, TrainedNetwork { topology: self.task.topology.clone(), weights, outcome });
            self.start_next(lane, queue);
            replaced = true;
        }
        replaced
    }

    #[inline(always)]
    fn sum_first_pattern(&mut self) {
        self.input_table.look_up(&self.order[0], &mut self.inputs);
        let layer = &mut self.layers[0];
        for (row, output) in layer.weights.chunks_exact(layer.row_len).zip(&mut layer.outputs) {
            *output = weighted_sum::<V, N, FIRST>(row, &self.inputs);
        }
    }

    #[inline(always)]
    fn run_epoch(&mut self) -> V {
        if self.task.rule.order == PresentationOrder::Shuffled {
            self.drawer.draw(&mut self.streams, &mut self.next_order);
        }
        let mut error = V::splat(V::Real::from_f64(0.0));
        for presentation in 0..self.order.len() {
            let following = self.order.get(presentation + 1).unwrap_or(&self.next_order[0]);
            self.input_table.look_up(following, &mut self.next_inputs);
            self.forward();
            self.target_table.look_up(&self.order[presentation], &mut self.targets);
            error = self.compare_with_targets(error);
            self.backward();
            self.update_first_layer();
            swap(&mut self.inputs, &mut self.next_inputs);
        }
        swap(&mut self.order, &mut self.next_order);
        error
    }

    #[inline(always)]
    fn forward(&mut self) {
        for k in 0..self.layers.len() {
            let (below, layer) = self.layers.split_at_mut(k);
            let layer = &mut layer[0];
            if let Some(below) = below.last() {
                for (row, output) in layer.weights.chunks_exact(layer.row_len).zip(&mut layer.outputs) {
                    *output = weighted_sum::<V, N, UPPER>(row, &below.outputs);
                }
            }
            let rows = layer.weights.len() / layer.row_len;
            logistic::activate(layer.activation, &mut layer.outputs[..rows]);
        }
    }

    #[inline(always)]
    fn compare_with_targets(&mut self, mut error: V) -> V {
        if let Some(layer) = self.layers.last_mut() {
            for ((target, output), delta) in self.targets.iter().zip(&layer.outputs).zip(&mut layer.deltas) {
                let difference = *target - *output;
                error = difference.mul_add(difference, error);
                *delta = difference * logistic::derivative(layer.activation, *output);
            }
        }
        error
    }

    #[inline(always)]
    fn backward(&mut self) {
        let (eta, alpha) = rates::<V, N>(self.task.rule);
        let zero = V::splat(V::Real::from_f64(0.0));
        for k in (1..self.layers.len()).rev() {
            let (below, layer) = self.layers.split_at_mut(k);
            let (below, layer) = (&mut below[k - 1], &mut layer[0]);
            below.deltas.fill(zero);
            let rows = layer.weights.chunks_exact(layer.row_len);
            let rows = rows.zip(layer.before.chunks_exact_mut(layer.row_len));
            for ((row, before), delta) in rows.zip(&layer.deltas) {
                let step = Step { delta: *delta, eta_delta: eta * *delta, alpha };
                update_and_send_back::<V, N, UPPER>(row, before, &below.outputs, &mut below.deltas, step);
            }
            swap(&mut layer.weights, &mut layer.before);
            for (delta, output) in below.deltas.iter_mut().zip(&below.outputs) {
                *delta = *delta * logistic::derivative(below.activation, *output);
            }
        }
    }

    #[inline(always)]
    fn update_first_layer(&mut self) {
        let (eta, alpha) = rates::<V, N>(self.task.rule);
        let layer = &mut self.layers[0];
        let rows = layer.weights.chunks_exact(layer.row_len);
        let rows = rows.zip(layer.before.chunks_exact_mut(layer.row_len));
        for (((row, before), output), delta) in rows.zip(&mut layer.outputs).zip(&layer.deltas) {
            let step = Step { delta: *delta, eta_delta: eta * *delta, alpha };
            *output = update_and_sum::<V, N, FIRST>(row, before, &self.inputs, &self.next_inputs, step);
        }
        swap(&mut layer.weights, &mut layer.before);
    }
}

#[inline(always)]
fn rates<V: Vector<N>, const N: usize>(rule: &BackPropagation) -> (V, V) {
    (V::splat(V::Real::from_f64(rule.learning_rate)), V::splat(V::Real::from_f64(rule.momentum)))
}

#[inline(always)]
fn weighted_sum<V: Vector<N>, const N: usize, const KNOWN: usize>(row: &[V], inputs: &[V]) -> V {
    let len = row_len::<KNOWN>(row.len());
    let (row, inputs) = (&row[..len], &inputs[..len]);
    let mut sum = V::splat(V::Real::from_f64(0.0));
    for i in 0..len {
        sum = row[i].mul_add(inputs[i], sum);
    }
    sum
}

/// η δ x + α Δ for one node.
#[derive(Clone, Copy)]
struct Step<V> {
    delta: V,
    eta_delta: V,
    alpha: V,
}

impl<V> Step<V> {
    #[inline(always)]
    fn apply<const N: usize>(&self, w: V, before: V, x: V) -> V
    where
        V: Vector<N>,
    {
        self.eta_delta.mul_add(x, self.alpha.mul_add(w - before, w))
    }
}

#[inline(always)]
fn update_and_sum<V: Vector<N>, const N: usize, const KNOWN: usize>(
    row: &[V],
    before: &mut [V],
    x: &[V],
    next_x: &[V],
    step: Step<V>,
) -> V {
    let len = row_len::<KNOWN>(row.len());
    let (row, before, x, next_x) = (&row[..len], &mut before[..len], &x[..len], &next_x[..len]);
    let mut sum = V::splat(V::Real::from_f64(0.0));
    for i in 0..len {
        let new = step.apply(row[i], before[i], x[i]);
        before[i] = new;
        sum = new.mul_add(next_x[i], sum);
    }
    sum
}

#[inline(always)]
fn update_and_send_back<V: Vector<N>, const N: usize, const KNOWN: usize>(
    row: &[V],
    before: &mut [V],
    x: &[V],
    back: &mut [V],
    step: Step<V>,
) {
    let len = row_len::<KNOWN>(row.len());
    let (row, before, x, back) = (&row[..len], &mut before[..len], &x[..len], &mut back[..len]);
    for i in 0..len {
        back[i] = row[i].mul_add(step.delta, back[i]);
        before[i] = step.apply(row[i], before[i], x[i]);
    }
}

fn set_lane<V: Vector<N>, const N: usize>(vector: &mut V, lane: usize, value: V::Real) {
    let mut values = vector.to_array();
    values[lane] = value;
    *vector = V::load(&values);
}

struct Table<R> {
    /// Power of two, so that a masked pick never lies outside.
    column_len: usize,
    values: Vec<R>,
}

impl<R: Real> Table<R> {
    fn from_rows(rows: &[f64], width: usize) -> Self {
        let column_len = column_len(rows.len() / width.max(1));
        let mut values = vec![R::from_f64(0.0); column_len * width];
        for (k, &value) in rows.iter().enumerate() {
            values[k % width * column_len + k / width] = R::from_f64(value);
        }
        Self { column_len, values }
    }

    /// Only the low bits of a pick count.
    #[inline(always)]
    fn look_up<V: Vector<N, Real = R>, const N: usize>(&self, picks: &[u32; N], values: &mut [V]) {
        if self.column_len == LOOK_UP {
            for (column, value) in self.values.as_chunks().0.iter().zip(values) {
                *value = V::look_up(column, picks);
            }
            return;
        }
        for (column, value) in self.values.chunks_exact(self.column_len).zip(values) {
            let mut lanes = [column[0]; N];
            for l in 0..N {
                lanes[l] = column[picks[l] as usize & (column.len() - 1)];
            }
            *value = V::load(&lanes);
        }
    }
}

#[cfg(test)]
mod tests;

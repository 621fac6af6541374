mod figures;
mod tables;

use maud::{Markup, html};

use super::StudyReport;
use super::bench_figures::bench_figure;
use super::numbers::{counted, listed, mm, number, rig_number};
use super::page::{Page, ReportFile, Section};
use super::study_report::{arms_table, glossary, least_error, longest, run_table, source};
use palpate_mechanics::sensing::SensorKind;
use palpate_mechanics::surface::{Beam, Surface, SurfaceSpec};
use palpate_rig::Rig;
use palpate_studies::paper::{Agreement, Claim, PublishedFigure, claims, published_figures};

const DOI: &str = "https://doi.org/10.5772/53567";

/// `report.html` and SVG figures.
///
/// Figures 2 to 6 and tables 1 to 3 have the paper's numbers. Parts that need an arm without a fit
/// are omitted.
pub fn paper_report(report: &StudyReport) -> Vec<ReportFile> {
    let paper = Paper {
        report,
        published: published_figures(report.results),
        claims: claims(report.outcomes, report.study.evaluation_settings()),
    };
    Page::new("A distributive tactile sensor, replicated", paper.summary(), paper.sections())
        .with_lead(introduction())
        .with_source(source(report))
        .files()
}

struct Paper<'a> {
    report: &'a StudyReport<'a>,
    published: Vec<PublishedFigure>,
    claims: Vec<Claim>,
}

impl Paper<'_> {
    fn sections(&self) -> Vec<Section> {
        let setup = self.setup().and_then(|(rig, _, force_n)| {
            bench_figure("The bench", rig.setup.surface(), rig.setup.layout(), force_n)
        });
        vec![
            Section::new("sensor", "The sensor").text(self.sensor()).figure(setup),
            Section::new("training", "How it learns")
                .text(training())
                .table(self.even_table())
                .text(glossary(self.report)),
            Section::new("position-output", "The starting point: ten positions")
                .text(self.starting_point())
                .figure(self.predicted_against_actual())
                .table(self.portions_table()),
            Section::new("output-coding", "Two codings of the output")
                .figure(self.iterations_by_coding())
                .figure(self.error_by_coding()),
            Section::new("arrangements", "Where to press: three arrangements")
                .text(arrangements())
                .table(self.edge_dense_table())
                .figure(self.error_by_arrangement())
                .figure(self.effective_length_by_arrangement()),
            Section::new("errors", "Errors along the beam")
                .figure(self.errors_of_codings())
                .figure(self.errors_of_arrangements()),
            Section::new("published", "Published against replicated")
                .text(self.published_section())
                .table(self.published_table()),
            Section::new("claims", "The paper's claims")
                .text(self.claims_section())
                .table(self.claims_table()),
            Section::new("not-replicated", "What does not replicate").text(self.not_replicated()),
            Section::new("open", "What the paper does not specify")
                .text(self.discrepancies_section())
                .table(self.open_table()),
            Section::new("arms", "All arms").table(arms_table(self.report)),
            Section::new("run", "The run").table(run_table(self.report)),
        ]
    }

    fn summary(&self) -> Markup {
        html! {
            li { (self.what_was_done()) }
            li { (self.agreement()) }
            li { (self.claims_in_short()) }
            @if let Some(sentence) = self.report.not_converged() { li { (sentence) } }
            @if let Some(best) = least_error(self.report) {
                li { (best) @if let Some(pitch) = self.sensor_pitch_mm() { " The sensors stand " (pitch) " mm apart." } }
            }
            @if let Some(best) = longest(self.report) { li { (best) } }
        }
    }

    fn what_was_done(&self) -> Markup {
        let arms = self.report.results.arms.len();
        let positions = self.report.study.evaluation_settings().positions.len();
        html! {
            (counted(self.report.networks(), "network", "networks")) " trained: " (counted(arms, "arm", "arms"))
            " that differ in training positions or output coding, " (self.report.seeds_in_words())
            " each. Every network was then asked for " (counted(positions, "contact position", "contact positions")) "."
        }
    }

    fn agreement(&self) -> Markup {
        let Agreement { agreeing, within_seeds, compared } = Agreement::new(&self.published);
        html! {
            @if compared == 0 {
                "No arm with a published figure was run, so no figure is compared."
            } @else if agreeing == compared {
                "All of the " a href="#published" { (counted(compared, "published figure", "published figures")) }
                " with an arm here agree with the medians found here, as far as was fixed beforehand; " (within_seeds)
                " lie within 5–95 % of the seeds."
            } @else {
                b { (agreeing) " of " (counted(compared, "published figure", "published figures")) } " "
                a href="#published" { "agree with the medians found here" } ", as far as was fixed beforehand; " b { (within_seeds) }
                " lie within 5–95 % of the seeds. "
                a href="#not-replicated" { "The figures that do not agree are listed" } "."
            }
        }
    }

    fn claims_in_short(&self) -> Markup {
        let ids = |holds| {
            self.claims.iter().filter(|claim| claim.holds == holds).map(|claim| claim.id).collect::<Vec<_>>()
        };
        let (held, failed) = (ids(true), ids(false));
        html! {
            @if self.claims.is_empty() {
                "The arms that the paper's claims are about were not all run, so no claim is tested."
            } @else if failed.is_empty() {
                "Every " a href="#claims" { "claim that could be tested" } " holds in the medians: " (listed(&held)) "."
            } @else if held.is_empty() {
                "No " a href="#claims" { "claim that could be tested" } " holds in the medians as it is worded: "
                (listed(&failed)) "."
            } @else {
                "Of the paper's " a href="#claims" { "claims" } ", " (listed(&held))
                @if held.len() == 1 { " holds" } @else { " hold" } " in the medians and " (listed(&failed))
                @if failed.len() == 1 { " does" } @else { " do" } " not in every part."
            }
        }
    }

    fn published(&self, arm: &str, key: &str) -> Option<&PublishedFigure> {
        let id = format!("{arm}.{key}");
        self.published.iter().find(|figure| figure.id == id)
    }

    /// All arms share them; `None` for another surface.
    fn setup(&self) -> Option<(&Rig, Beam, f64)> {
        let rig = &self.report.study.study.arms.first()?.rig;
        let SurfaceSpec::Beam(beam) = rig.setup.surface() else { return None };
        Some((rig, *beam, rig.setup.force_n()?))
    }

    fn sensor_pitch_mm(&self) -> Option<String> {
        let (rig, ..) = self.setup()?;
        let positions: Vec<f64> =
            rig.setup.layout().sensors().iter().map(|sensor| sensor.position.x_m).collect();
        let pitches: Vec<f64> = positions.windows(2).map(|pair| pair[1] - pair[0]).collect();
        let first = *pitches.first()?;
        pitches.iter().all(|pitch| (pitch - first).abs() < 1e-6).then(|| number(first * 1e3))
    }

    fn sensor(&self) -> Markup {
        html! {
            p {
                "A distributive tactile sensor has few sensors and they all stand under one elastic surface. Wherever the \
                 surface is touched, all of it bends, and every sensor notices. No sensor covers a place of its own: the place \
                 is in the pattern across all of them. The accuracy therefore depends on the interpretation of the pattern \
                 more than on the number of sensors, and two sensors have no dead area between them."
            }
            @if let Some((rig, beam, force_n)) = self.setup() { (bench_in_words(rig, beam, force_n)) }
        }
    }

    fn starting_point(&self) -> Markup {
        html! {
            p {
                "The paper begins with the position output and ten equally spaced training positions. "
                @if self.report.outcome("position-10").is_none() { "That arm was not run." }
            }
        }
    }
}

fn introduction() -> Markup {
    html! {
        p.lead {
            "A bent beam reveals where it is touched. This page repeats, in simulation, the study with which P. \
             Tongpadungrod showed how to train a small neural network to do so, and sets every figure that the paper \
             prints beside the same figure found here: "
            cite { "Neural network training techniques for improving the performance of a distributive tactile sensor" }
            ", International Journal of Advanced Robotic Systems, " a href=(DOI) { "doi:10.5772/53567" } "."
        }
    }
}

fn training() -> Markup {
    html! {
        p {
            "The interpreter is a small feed-forward network. The inputs are the sensors' readings; the single output stands \
             for the position of the load. It is trained by back-propagation: a load is put at a few known "
            b { "training positions" } ", the network is shown the readings again and again, and each time its weights \
             move so that its output comes nearer to the known position. It then has to locate loads at other places."
        }
        p {
            "The paper asks three things. What should the output stand for: the plain position in metres, or the \
             position divided by the beam's length, which uses the whole range of the output? How many training \
             positions are enough? And does it help to crowd them towards the supports?"
        }
        p {
            "Each way to train is an " b { "arm" } " of the study, named after what the output stands for or where the \
             training positions are, and after their number: " code { "position-10" } " has the plain position as its output \
             and ten training positions, " code { "normalized-20" } " the position divided by the length and twenty, "
            code { "middle4-30" } " thirty, with four in the middle portion, and again a normalized output."
        }
    }
}

fn arrangements() -> Markup {
    html! {
        p {
            "Equally spaced training positions leave the network to guess beyond the first and the last of them. So the \
             paper tries arrangements with the same number of positions, but fewer of them in the middle portion and \
             more near the supports. All networks of these arrangements have the normalized output."
        }
    }
}

fn bench_in_words(rig: &Rig, beam: Beam, force_n: f64) -> Markup {
    let sag_mm = force_n * beam.full_scale(SensorKind::Deflection) * 1e3;
    html! {
        p {
            "The surface here is a beam, " (mm(beam.length_m())) " mm long, " (mm(beam.width_m())) " mm wide and "
            (mm(beam.thickness_m())) " mm thick, with a Young's modulus of " (rig_number(beam.youngs_modulus_pa() / 1e9))
            " GPa, on two wedges at its ends. "
            (counted(rig.setup.layout().len(), "sensor measures", "sensors measure")) " its " (kinds(rig)) " while a load of "
            (rig_number(force_n)) " N, which is known, stands on it. With the load in the middle the beam sags by "
            (number(sag_mm)) " mm there."
        }
    }
}

fn kinds(rig: &Rig) -> String {
    let mut names: Vec<&str> = rig.setup.layout().sensors().iter().map(|sensor| sensor.kind.name()).collect();
    names.dedup();
    names.join(", ")
}

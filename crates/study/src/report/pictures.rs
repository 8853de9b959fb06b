//! Rendered moments of a contact: the truth, each method's prediction, and where it errs.

use anyhow::Result;
use tissue::mesh::Mesh;

use super::cases::Case;
use super::html::{Gallery, Picture};
use super::row::Measurement;
use picture::plot::{escape, label};
use picture::render::{Camera, Palette, contact_camera, deformed, lengths};

const WIDTH: usize = 640;
const HEIGHT: usize = 460;

/// Moments worth a look: the deepest push, and 0.2 s after the contact was first lifted.
pub fn moments(case: &Case) -> Vec<usize> {
    let trajectory = &case.trajectory;
    let frames = trajectory.frame_count();
    let largest = |frame: usize| {
        trajectory
            .frame(frame)
            .iter()
            .map(|u| u.iter().map(|v| v * v).sum::<f32>())
            .fold(0.0f32, f32::max)
    };
    let deepest = (1..frames)
        .max_by(|a, b| largest(*a).total_cmp(&largest(*b)))
        .unwrap_or(1);
    let mut moments = vec![deepest];
    let released = (2..frames).find(|frame| {
        trajectory.contact(*frame).0.is_empty() && !trajectory.contact(frame - 1).0.is_empty()
    });
    if let Some(frame) = released
        .map(|frame| frame + 4)
        .filter(|frame| *frame < frames && *frame != deepest && largest(*frame) > 0.25)
    {
        moments.push(frame);
    }
    moments
}

/// The mesh at `displacement`, coloured by `values`, as a PNG file.
fn render(
    mesh: &Mesh,
    displacement: &[[f32; 3]],
    values: &[f32],
    palette: Palette,
    full_scale: f32,
    camera: &Camera,
) -> Result<Vec<u8>> {
    deformed(mesh, displacement, values, palette, full_scale, camera).png()
}

fn differences(a: &[[f32; 3]], b: &[[f32; 3]]) -> Vec<f32> {
    a.iter()
        .zip(b)
        .map(|(a, b)| (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f32>().sqrt())
        .collect()
}

fn largest(values: &[f32]) -> f32 {
    values.iter().copied().fold(0.0, f32::max)
}

/// One gallery for each (case, frame): truth, then prediction and error of each measurement that kept the frame.
pub fn galleries(
    mesh: &Mesh,
    cases: &[Case],
    moments: &[(usize, usize)],
    shown: &[&Measurement],
) -> Result<Vec<Gallery>> {
    let mut galleries = Vec::new();
    for (case_index, frame) in moments {
        let case = &cases[*case_index];
        let truth = case.trajectory.frame(*frame);
        let camera = contact_camera(&mesh.positions, case.trajectory.header.site, WIDTH, HEIGHT);
        let lengths_of_truth = lengths(truth);
        let kept: Vec<(&Measurement, &[[f32; 3]])> = shown
            .iter()
            .filter_map(|one| {
                let frame = one
                    .pictured
                    .iter()
                    .find(|kept| kept.case == *case_index && kept.step == *frame)?;
                Some((*one, frame.displacement.as_slice()))
            })
            .collect();
        // The peak is a few nodes; three quarters of it leaves the body of the deformation readable.
        let displacement_scale = (0.75 * largest(&lengths_of_truth)).max(0.5);
        let errors: Vec<Vec<f32>> = kept
            .iter()
            .map(|(_, field)| differences(truth, field))
            .collect();
        let error_scale = errors
            .iter()
            .map(|values| largest(values))
            .fold(0.1f32, f32::max);
        let mut columns = vec![vec![Picture {
            caption: format!(
                "The truth, by the reference solver: {} mm at most",
                label(f64::from(largest(&lengths_of_truth)))
            ),
            png: render(
                mesh,
                truth,
                &lengths_of_truth,
                Palette::Displacement,
                displacement_scale,
                &camera,
            )?,
        }]];
        for ((one, field), error) in kept.iter().zip(&errors) {
            let prediction = Picture {
                caption: one.row.family(),
                png: render(
                    mesh,
                    field,
                    &lengths(field),
                    Palette::Displacement,
                    displacement_scale,
                    &camera,
                )?,
            };
            let error = Picture {
                caption: format!("its error: {} mm at most", label(f64::from(largest(error)))),
                png: render(mesh, field, error, Palette::Error, error_scale, &camera)?,
            };
            columns.push(vec![prediction, error]);
        }
        let legend = format!(
            "<div class=\"legend\">{}{}</div>",
            ramp("displacement", Palette::Displacement, displacement_scale),
            ramp("error", Palette::Error, error_scale)
        );
        let time = *frame as f64 * case.trajectory.header.dt_s;
        galleries.push(Gallery {
            title: format!("{}: {time:.2} s", capitalised(&case.name)),
            columns,
            legend,
        });
    }
    Ok(galleries)
}

fn capitalised(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or_else(String::new, |first| {
        first.to_uppercase().collect::<String>() + letters.as_str()
    })
}

fn ramp(name: &str, palette: Palette, full_scale: f32) -> String {
    let stops: Vec<String> = (0..=8)
        .map(|index| palette.hex(index as f32 / 8.0))
        .collect();
    format!(
        "<span>{} 0 <i class=\"ramp\" style=\"background:linear-gradient(to right,{})\"></i>{} mm or more</span>",
        escape(name),
        stops.join(","),
        label(f64::from(full_scale))
    )
}

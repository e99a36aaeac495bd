//! PAB-Opto files: writing and reading.

use glimpse_core::geometry::{Angles, HalfDifference};
use glimpse_materials::loss::loss_between;
use glimpse_materials::{
    Brdf, Coverage, Format, Material, PabSet, Procedural, Source, SourceError,
};

use crate::FunctionMaterial;
use crate::common::assert_names;
use crate::folder::{Folder, load};
use crate::formats::tabulated;

/// Writes the files of a material into a folder.
fn write(folder: &Folder, name: &str, material: &dyn Material) {
    let endings = Format::Pab.properties().written.iter();
    for (ending, text) in endings.zip(tabulated(Format::Pab, name, material)) {
        folder.write(&format!("{name}{ending}"), text);
    }
}

#[test]
fn written_files_match_the_brdf() {
    // Rubber has a highlight, and the other BRDFs are smooth.
    let set = Procedural::set(40, 2);
    let find_class = |class: &str| set.iter().find(|material| material.name().contains(class));
    let [fabric, rubber] =
        ["fabric", "rubber"].map(|class| find_class(class).expect("the set has all classes"));
    let constant = FunctionMaterial(|_| [0.3, 0.2, 0.1]);
    let materials: [(&str, &dyn Material, f64); 3] = [
        ("constant", &constant, 1e-3),
        ("fabric", fabric, 0.01),
        ("rubber", rubber, 0.02),
    ];
    let folder = Folder::new();
    for (name, material, max_loss) in materials {
        write(&folder, name, material);
        let path = folder.at(&format!("{name}_in40.txt"));
        let set = PabSet::read(&path).expect("the file is read");
        assert_eq!(set.coverage().unknown(), 0.0, "{name}");
        let loss = loss_between(&set, material);
        assert!(loss < max_loss, "{name}: {loss}");
        let files = Source(path.display().to_string()).files();
        let count = files.expect("the files are listed").len();
        assert_eq!(count, Format::Pab.properties().written.len());
    }

    // Loading as a material resamples the values, which takes seconds.
    let read = load(&folder.at("rubber_in00.txt")).expect("the file is read");
    assert_eq!(read[0].name(), "rubber");
    let loss = loss_between(&*read[0], rubber);
    assert!(loss < 0.02, "{loss}");
}

/// Returns a file with equal values at outgoing directions up to a theta_o, in degrees, with steps of 10 degrees.
fn gray(header: &str, theta_i: f64, max_theta_o: u32, value: f64) -> String {
    let header = format!(
        "{header}#colorimetry: CIE-Y\n#format: theta phi BRDF\n#intheta {theta_i}\n#inphi 0\n"
    );
    let theta_o = (0..=max_theta_o).step_by(10);
    let angles = theta_o.flat_map(|theta| (0..360).step_by(20).map(move |phi| (theta, phi)));
    let lines = angles.map(|(theta, phi)| format!("{theta} {phi} {value}\n"));
    header + &lines.collect::<String>()
}

/// Returns the BRDF of a set in the plane of incidence. theta_o is positive on the side of the mirror direction, in degrees.
fn brdf(set: &PabSet, theta_i: f64, theta_o: f64) -> f32 {
    let half = 0.5 * (theta_o - theta_i).to_radians();
    let at = Angles {
        theta_h: half.abs() as f32,
        theta_d: (0.5 * (theta_i + theta_o)).to_radians() as f32,
        phi_d: if half < 0.0 {
            0.0
        } else {
            std::f32::consts::PI
        },
    };
    let incoming = HalfDifference::from_angles(at).directions().incoming;
    assert!((f64::from(incoming[2].acos()).to_degrees() - theta_i).abs() < 0.01);
    let [red, green, blue] = set.at_angles(at);
    assert!([green, blue].map(f32::to_bits) == [red.to_bits(); 2] || (red - green).abs() < 1e-6);
    red
}

#[test]
fn finds_files_of_set_by_names() {
    // The samples' names, or none, and the files' names. The last file is of another set.
    for names in [
        "card:first.dat card:second.txt mat:third.dat",
        "card_in20:a.dat card_in40:b.dat mat_in40:c.dat",
        "m1:card_20.dat m2:card_040.0.dat m3:mat_40.dat",
        ":card1_20.dat :card1_40.dat :card2_40.dat",
        ":card_001.dat :card_002.dat :mat_002.dat",
        ":20.dat :40.dat :mat.dat",
        "m:card.020 m:card.040 m2:mat.040",
    ] {
        let folder = Folder::new();
        let incidences = [(20.0, 0.1), (40.0, 0.4), (40.0, 9.0)];
        let files = names
            .split(' ')
            .zip(incidences)
            .map(|(names, (theta_i, value))| {
                let (sample, file) = names.split_once(':').expect("two names");
                let header = match sample {
                    "" => String::new(),
                    _ => format!("#sample_name \"{sample}\"\n"),
                };
                folder.write(file, gray(&header, theta_i, 80, value))
            });
        let files: Vec<_> = files.collect();
        folder.write("notes.txt", "notes");
        folder.write("broken.txt", b"\xff\xfe");
        let [first, second, _] = &files[..] else {
            panic!("{files:?}")
        };
        for path in [first, second] {
            let set = PabSet::read(path).expect("the set is read");
            let Coverage::Incidences { files, unknown } = set.coverage() else {
                panic!("{:?}", set.coverage());
            };
            assert_eq!(files, [(first.clone(), 20.0), (second.clone(), 40.0)]);
            assert!((0.3..0.7).contains(&unknown), "{unknown}");
            assert!((brdf(&set, 30.0, 10.0) - 0.25).abs() < 1e-3);
        }
    }
}

#[test]
fn unmeasured_directions_are_unknown() {
    let folder = Folder::new();
    let first = folder.write("gray_30.dat", gray("", 30.0, 40, 0.1));
    let set = PabSet::read(&first).expect("a single file");
    let is_known = |set: &PabSet, theta_i, theta_o| !brdf(set, theta_i, theta_o).is_nan();
    // Up to 10 degrees from theta_i, and 20 degrees from the outgoing directions.
    for (theta_i, theta_o, expected) in [
        (30.0, 30.0, true),
        (39.9, 39.9, true),
        (20.1, 20.1, true),
        (40.1, 40.1, false),
        (19.9, 19.9, false),
        (0.0, 10.0, false),
        (30.0, 59.9, true),
        (30.0, 60.1, false),
        (30.0, -59.9, true),
        (30.0, -60.1, false),
    ] {
        let known = is_known(&set, theta_i, theta_o);
        assert_eq!(known, expected, "theta_i {theta_i}, theta_o {theta_o}");
        assert!(!known || (brdf(&set, theta_i, theta_o) - 0.1).abs() < 1e-6);
    }
    let error = load(&first).err().expect("the set is incomplete");
    let SourceError::Incomplete { name, coverage } = error else {
        panic!("{error}");
    };
    assert_eq!((name.as_str(), coverage), ("gray_30.dat", set.coverage()));

    // A gap of 30 degrees is interpolated, and one of 31 is not.
    for (theta_i, is_interpolated) in [(60.0, true), (61.0, false)] {
        let second = folder.write(&format!("gray_{theta_i}.dat"), gray("", theta_i, 80, 0.4));
        let set = PabSet::read(&second).expect("two files");
        assert_eq!(is_known(&set, 45.0, 30.0), is_interpolated);
        assert!((brdf(&set, 32.0, 30.0) - 0.1).abs() < 0.03);
        std::fs::remove_file(second).expect("the file is removed");
    }
    for (name, theta_i) in [
        ("gray_10.dat", 10.0),
        ("gray_60.dat", 60.0),
        ("gray_80.dat", 80.0),
    ] {
        folder.write(name, gray("", theta_i, 80, 0.1));
    }
    folder.write("gray_30.dat", gray("", 30.0, 80, 0.1));
    let set = PabSet::read(&first).expect("a complete set");
    assert_eq!(set.coverage().unknown(), 0.0);
    assert!((brdf(&set, 5.0, 85.0) - 0.1).abs() < 1e-6);
}

#[test]
fn joins_patterns_at_an_incoming_direction() {
    let folder = Folder::new();
    let path = folder.write("gray_30.dat", gray("", 30.0, 80, 0.1));
    // A finer pattern around the mirror direction, with the azimuth of the same direction.
    let fine = "#colorimetry: CIE-Y\n#format: theta phi BRDF\n#intheta 30\n#inphi 360\n";
    let lines =
        (24..36).flat_map(|theta| (174..186).map(move |phi| format!("{theta} {phi} 0.9\n")));
    folder.write("gray_030.dat", fine.to_owned() + &lines.collect::<String>());
    let set = PabSet::read(&path).expect("the set is read");
    assert!((brdf(&set, 30.0, 25.5) - 0.9).abs() < 1e-5);
    assert!((brdf(&set, 30.0, -50.0) - 0.1).abs() < 1e-5);
    let Coverage::Incidences { files, .. } = set.coverage() else {
        panic!("{:?}", set.coverage());
    };
    assert_eq!(files.len(), 2);
}

#[test]
fn rejects_sets_with_several_azimuths() {
    let folder = Folder::new();
    let text = gray("#sample_name gray\n", 30.0, 80, 0.1);
    let path = folder.write("a.dat", &text);
    folder.write("b.dat", text.replace("inphi 0", "inphi 90"));
    let error = load(&path).err().expect("the files are rejected");
    assert_names(&error.to_string(), &["inphi", "0", "90"]);
}

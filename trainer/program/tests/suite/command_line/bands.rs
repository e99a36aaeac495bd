//! Readings in bands.

use std::f64::consts::PI;

use super::{Folder, number};

/// The light at 45 degrees, and the sensor at six angles.
const ANGLES: &str = "theta_i,theta_o\n45,60\n45,30\n45,20\n45,0\n45,-30\n45,-65\n";
const WAVELENGTHS: [f64; 8] = [420.0, 460.0, 500.0, 540.0, 580.0, 620.0, 660.0, 700.0];

/// Writes `read.csv`: a material whose bands are smooth mixtures of its channels, as reflectance factors in percent.
fn read(folder: &Folder) {
    folder.write("angles.csv", ANGLES);
    folder.succeed("query procedural:1:9 --angles angles.csv --out rgb.csv");
    let names = WAVELENGTHS.map(|nm| format!("{nm}nm")).join(",");
    let mut csv = format!("theta_i,theta_o,{names}\n");
    for row in folder.read_text("rgb.csv").lines().skip(1) {
        let cells: Vec<f64> = row
            .split(',')
            .map(|cell| cell.parse().expect("a number"))
            .collect();
        let [angles @ .., r, g, b] = &cells[..] else {
            panic!("{row}");
        };
        let bands = WAVELENGTHS.map(|nm| {
            let weights =
                [620.0, 540.0, 450.0].map(|center: f64| (-((nm - center) / 60.0).powi(2)).exp());
            let [red, green, blue] = weights;
            let brdf = (red * r + green * g + blue * b) / weights.iter().sum::<f64>();
            format!("{}", 100.0 * PI * brdf)
        });
        let (theta_i, theta_o) = (angles[0], angles[1]);
        csv += &format!("{theta_i},{theta_o},{}\n", bands.join(","));
    }
    folder.write("read.csv", csv);
}

/// Returns the columns of readings and of the fit, row by row.
fn bands(folder: &Folder, fit: &str) -> Vec<[Vec<f64>; 2]> {
    // A plot of a line for the readings and one for the fit, at each of six angles.
    let svg = folder.read_text(&format!("{fit}/bands.svg"));
    assert_eq!(svg.matches("<g class=\"c").count(), 12);
    let csv = folder.read_text(&format!("{fit}/bands.csv"));
    let rows = csv.lines().skip(1).map(|row| {
        let cells: Vec<f64> = row
            .split(',')
            .filter_map(|cell| cell.parse().ok())
            .collect();
        let (rest, fitted) = cells.split_at(cells.len() - WAVELENGTHS.len());
        [
            rest[rest.len() - WAVELENGTHS.len()..].to_vec(),
            fitted.to_vec(),
        ]
    });
    rows.collect()
}

#[test]
fn fits_follow_readings_in_bands() {
    let folder = Folder::new();
    read(&folder);
    folder.succeed("recipes get linear-any neural-any phong-any");
    for (model, mean_error) in [("linear", 0.03), ("neural", 0.08)] {
        let report = folder.succeed_as_json(&format!(
            "fit {model}-any.recipe --measurements read.csv --quantity reflectance-percent --out {model}"
        ));
        let readings = report[0]["spectrum"]["readings"]
            .as_array()
            .expect("readings");
        assert_eq!(readings.len(), 6);
        let aspecular = readings
            .iter()
            .map(|reading| number(&reading["aspecular"]).round());
        assert_eq!(
            aspecular.collect::<Vec<_>>(),
            [-15.0, 15.0, 25.0, 45.0, 75.0, 110.0]
        );
        for reading in readings {
            assert!(number(&reading["delta_e"]) < 1.0, "{model}: {reading}");
        }
        for [measured, fitted] in bands(&folder, model) {
            let errors = measured
                .iter()
                .zip(&fitted)
                .map(|(a, b)| (b / a - 1.0).abs());
            assert!(
                errors.sum::<f64>() / 8.0 < mean_error,
                "{model}: {measured:?} {fitted:?}"
            );
        }
    }
    // The material is the color of its bands, also from its file.
    folder.succeed("query linear --angles angles.csv --out colors.csv");
    let colors = folder.read_text("colors.csv");
    let fitted = folder.read_text("linear/readings.csv");
    for (color, fitted) in colors.lines().zip(fitted.lines()).skip(1) {
        let color: Vec<f64> = color
            .rsplit(',')
            .take(3)
            .map(|cell| cell.parse().expect("a number"))
            .collect();
        let fitted: Vec<&str> = fitted.split(',').collect();
        for (channel, value) in color.iter().rev().enumerate() {
            let fitted: f64 = fitted[12 + channel].parse().expect("a number");
            assert!((value / fitted - 1.0).abs() < 1e-4, "{value} {fitted}");
        }
    }
    // The file of bands is a file of readings.
    folder.succeed("fit --measurements linear/bands.csv --illuminant a --observer 10 --out again");
    for ([_, first], [_, again]) in bands(&folder, "linear").iter().zip(bands(&folder, "again")) {
        let errors = first.iter().zip(again).map(|(a, b)| (b / a - 1.0).abs());
        assert!(errors.fold(0.0, f64::max) < 0.01, "{first:?}");
    }
    // A tile of 50 % halves the readings.
    folder.succeed(
        "fit --measurements read.csv --quantity reflectance-percent --white-reflectance 0.5 --out half",
    );
    for ([whole, _], [half, _]) in bands(&folder, "linear").iter().zip(bands(&folder, "half")) {
        assert!((half[0] / whole[0] - 0.5).abs() < 1e-5);
    }
    folder.fail("fit phong-any.recipe --measurements read.csv --out phong");
}

#[test]
fn damaged_bands_are_refused() {
    let folder = Folder::new();
    read(&folder);
    let text = folder.read_text("read.csv");
    let empty = text.replacen(
        text.lines()
            .nth(1)
            .expect("a row")
            .rsplit(',')
            .next()
            .expect("a cell"),
        "",
        1,
    );
    for (name, text) in [
        ("empty", empty),
        ("double", text.replace("460nm", "w420")),
        ("both", text.replace("420nm,460nm,500nm", "r,g,b")),
        ("negative", text.replace("60,", "60,-900,")),
    ] {
        folder.write("damaged.csv", text);
        let message = folder.fail("fit --measurements damaged.csv --out damaged");
        assert!(message.contains("damaged.csv"), "{name}: {message}");
    }
    folder.fail("fit --measurements rgb.csv --illuminant a --out colors");
    folder.fail("fit --measurements rgb.csv --white-reflectance 0.5 --out relative");
}

#[test]
fn invisible_bands_have_no_color() {
    let folder = Folder::new();
    let readings = "theta_i,theta_o,905nm,1550nm\n45,45,0.3,0.5\n45,0,0.1,0.3\n";
    folder.write("nir.csv", readings);
    let fit = "fit --measurements nir.csv --format rgl-spectral --out nir";
    let spectrum = &folder.succeed_as_json(fit)[0]["spectrum"];
    assert!(spectrum["illuminant"].is_null() && spectrum["readings"][0]["delta_e"].is_null());
    let names = "theta_h,theta_d,phi_d,quantity,aspecular,905,1550,fitted_905,fitted_1550\n";
    assert!(folder.read_text("nir/bands.csv").starts_with(names));
    assert!(folder.at("nir/bands.svg").exists() && !folder.at("nir/sphere.png").exists());
    // The channels are the mean of the bands.
    let channels = folder.read_text("nir/readings.csv");
    assert!(channels.contains(",0.4,0.4,0.4,brdf"), "{channels}");
    folder.fail("fit --measurements nir.csv --observer 10 --out colors");
}

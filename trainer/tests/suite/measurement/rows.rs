//! Rows in any order, missing, repeated, by angles or by number; and what is said of those that are wrong.

use glimpse_trainer::measurement::spread;

use super::{measured, mistake};
use crate::common::assert_names;

#[test]
fn rows_come_in_any_order_and_some_are_missing_or_repeated() {
    // The samples 0, 1 and 2 at theta_i, theta_o: 30 30, ~22.3 22.3, and not at all. Turned about the
    // normal, and a little off.
    let read = measured(
        "b,note,theta_o,phi_o,theta_i,phi_i,g,r\n\
         0.3,x,30.1,10,30,190.2,0.2,0.1\n\
         ,,30,10,30,190,,\n\
         0.5,\"a, b\",29.9,10,30,190,0.4,0.3\n\
         nan,,30,10,30,190,NaN,nan\n",
    )
    .expect("it is read");
    assert_eq!((read.rows, read.missing()), (2, vec![1, 2]));
    let mean = read.samples[0].mean().expect("it was read");
    for (mean, expected) in mean.into_iter().zip([0.2, 0.3, 0.4]) {
        assert!((mean - expected).abs() < 1e-6);
    }
    // Deviations of 0.1414 in each channel, by means of 0.9 together.
    let varies = spread(&read.samples[0]).expect("it was read twice");
    assert!((varies - 3.0 * 0.141_421 / 0.9).abs() < 1e-4, "{varies}");
    assert_eq!(spread(&read.samples[1]), None);
    let far = read.furthest.expect("it says its directions");
    assert!((far.largest.to_degrees() - 0.1).abs() < 1e-3, "{far}");
}

#[test]
fn a_sensor_with_one_channel_and_samples_by_number() {
    let read = measured("index,value,saturated\n2,0.5,1\n0,0.25,0\n").expect("it is read");
    assert_eq!(read.samples[2].mean(), Some([0.5; 3]));
    assert!(read.samples[2].saturated() && !read.samples[0].saturated());
    assert_eq!((read.missing(), read.furthest), (vec![1], None));
    // Angles may be left out where the number is given; where they are there, they are checked.
    let text = "theta_h,index,theta_d,phi_d,value\n,1,,,0.5\n20,1,10,90.2,0.7\n";
    let read = measured(text).expect("it is read");
    assert_eq!(read.samples[1].count(), 2);
}

/// Spreadsheets write capitals, and numbers of samples with a point.
#[test]
fn names_and_numbers_are_taken_as_programs_write_them() {
    let read = measured("Index,Value\n2.0,0.5\n").expect("it is read");
    assert_eq!(read.samples[2].mean(), Some([0.5; 3]));
}

#[test]
fn mistakes_name_the_line_and_the_column() {
    for (text, named) in [
        ("r,g,b\n1,2,3\n", &["theta_h", "theta_i", "index"][..]),
        ("index,r,g\n", &["r, g, b", "value"]),
        ("index,r,g,b,value\n", &["r, g, b", "value"]),
        ("index,value,value\n0,1,1\n", &["value"]),
        ("index,value\n", &[]),
        ("", &[]),
        ("index;value\n0;1,5\n", &[]),
        ("index\tvalue\n0\t1\n", &[]),
        ("index,value\n0,1,5\n", &["2", "3"]),
        ("index,value\n0,\n1,nan\n", &[]),
        ("index,value\n0,1\n\n3,1\n", &["4", "index", "3", "2"]),
        ("index,value\n-1,1\n", &["2", "index", "-1"]),
        ("index,value\n,1\n", &["2", "index"]),
        ("index,r,g,b\n0,1,,1\n", &["2", "g"]),
        ("index,r,g,b\n0,1,inf,1\n", &["2", "g", "inf"]),
        ("index,r,g,b\n0,1,x,1\n", &["2", "g", "x"]),
        (
            "index,value,saturated\n0,1,yes\n",
            &["2", "saturated", "yes"],
        ),
        ("index,value\n0,-1.5\n", &["2", "0", "-1"]),
        (
            "theta_h,theta_d,phi_d,value\n0,x,0,1\n",
            &["2", "theta_d", "x"],
        ),
    ] {
        assert_names(&mistake(measured(text)), named);
    }
}

#[test]
fn a_near_miss_is_named() {
    let told = mistake(measured(
        "theta_i,phi_i,theta_o,phi_o,value\n30,0,30,180,1\n30,0,31.2,180,1\n",
    ));
    let near = [
        "3",
        "1.20",
        "theta_o",
        "0",
        "30",
        "180",
        "--tolerance",
        "0.5",
    ];
    assert_names(&told, &near);
    let told = mistake(measured("theta_h,theta_d,phi_d,index,value\n0,30,0,1,1\n"));
    assert_names(&told, &["2", "1", "0"]);
}

#[test]
fn radians_are_suspected_aloud() {
    let in_radians = "theta_h,theta_d,phi_d,value\n\
                      0,0.5235988,0,1\n\
                      0.3490659,0.1745329,1.5707963,1\n";
    let degrees_in_a_radian = "57.29578";
    let told = mistake(measured(in_radians));
    assert_names(&told, &[degrees_in_a_radian]);
    // Not of a file in which only some would match.
    let told = mistake(measured(&format!("{in_radians}0.7,0.2,0.1,1\n")));
    assert!(!told.contains(degrees_in_a_radian), "{told}");
}

#[test]
fn other_dialects_are_taken_or_named() {
    let whole = "theta_h,theta_d,phi_d,r,g,b\n0,30,0,0.25,0.5,0.75\n20,10,90,1,2,3\n";
    for same in [
        whole.replace('\n', "\r\n"),
        whole.replace('\n', "\r"),
        format!("\u{feff}{whole}"),
        whole.trim_end().to_owned(),
    ] {
        let read = measured(&same).expect("it is read");
        assert_eq!(read.rows, 2);
        assert_eq!(read.samples[0].mean(), Some([0.25, 0.5, 0.75]));
    }
    let long = "x".repeat(100_000);
    for (text, named) in [
        (whole.replace(',', ";"), &[][..]),
        (whole.replace(',', "\t"), &[]),
        (whole.replace("0.25", "0,25"), &["2", "7", "6"]),
        (whole.replace("0.25", "1e39"), &["1e39"]),
        (whole.replace("0.25", "-9"), &["2"]),
        (whole.replace("0,30,0", "0,0.5236,0"), &["2"]),
        (whole.replace("0.25", &long), &["2"]),
        (whole.replace("r,g", "\u{1b}[2J,g"), &["\\u{1b}[2J"]),
        (whole[..28].to_owned(), &[]),
        (String::new(), &[]),
    ] {
        let told = mistake(measured(&text));
        assert_names(&told, named);
        assert!(
            !told.contains(char::is_control) && told.len() < 600,
            "{told}"
        );
    }
}

/// A CSV need not end its last line, so that a cut within a number leaves another one: then a sample is
/// missing, or it is one row that is wrong.
#[test]
fn a_cut_leaves_fewer_rows_or_a_message() {
    let whole = "index,r,g,b\n0,0.25,0.5,0.75\n1,1.5,2.5,3.5\n2,0.1,0.2,0.3\n";
    for length in 0..whole.len() {
        match measured(&whole[..length]) {
            Ok(read) => {
                let ends = whole[..length].matches('\n').count();
                assert!(read.rows == ends || read.rows + 1 == ends, "{length}");
            }
            refused => {
                mistake(refused);
            }
        }
    }
}

//! PAB-Opto files: writing and reading.

use glimpse_materials::loss::loss_between;
use glimpse_materials::{Material, PabSet, Procedural, Source, pab_suffixes, to_pab};

use crate::FunctionMaterial;
use crate::common::assert_names;
use crate::folder::{Folder, load};

/// Writes the files of a material into a folder.
fn write(folder: &Folder, name: &str, material: &dyn Material) {
    let texts = to_pab(name, material).expect("the BRDF is finite");
    for (suffix, text) in pab_suffixes().zip(texts) {
        folder.write(&format!("{name}{suffix}"), text);
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
        let loss = loss_between(&set, material);
        assert!(loss < max_loss, "{name}: {loss}");
        let files = Source(path.display().to_string()).files();
        let count = files.expect("the files are listed").len();
        assert_eq!(count, pab_suffixes().count());
    }

    // Loading as a material resamples the values, which takes seconds.
    let read = load(&folder.at("rubber_in00.txt")).expect("the file is read");
    assert_eq!(read[0].name(), "rubber");
    let loss = loss_between(&*read[0], rubber);
    assert!(loss < 0.02, "{loss}");
}

#[test]
fn reads_only_files_of_the_same_sample() {
    let folder = Folder::new();
    write(&folder, "one", &FunctionMaterial(|_| [0.3; 3]));
    write(&folder, "other", &FunctionMaterial(|_| [0.1; 3]));
    folder.write("notes.txt", "notes");
    folder.write("broken.txt", b"\xff\xfe");
    for (name, value) in [("one", 0.3), ("other", 0.1)] {
        let path = folder.at(&format!("{name}_in00.txt"));
        let read = PabSet::read(&path).expect("the file is read");
        let loss = loss_between(&read, &FunctionMaterial(move |_| [value; 3]));
        assert!(loss < 1e-3, "{name}: {loss}");
    }
}

#[test]
fn rejects_inconsistent_sets() {
    let text = "#colorimetry: CIE-Y\n#format: theta phi BRDF\n#intheta 30\n#inphi 0\n10 0 0.1\n";
    // Two files with different phi_i, and two files with the same theta_i and phi_i.
    for (second, words) in [
        (
            text.replace("inphi 0", "inphi 90"),
            &["inphi", "0", "90"][..],
        ),
        (text.to_owned(), &["intheta", "30"]),
    ] {
        let folder = Folder::new();
        let path = folder.write("a.dat", text);
        folder.write("b.dat", second);
        let error = load(&path).err().expect("the files are rejected");
        assert_names(&error.to_string(), words);
    }
}

//! All but the fit: what a model's binary is larger than this one, the fit takes.

#![no_std]
#![no_main]

use glimpse_bench::report;

glimpse_bench::firmware!({
    report::nothing();
    Ok(())
});

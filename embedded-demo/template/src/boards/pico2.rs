//! Raspberry Pi Pico 2. The line is a USB serial port.

use defmt_rtt as _; // log
use embassy_executor::Spawner;
use embassy_futures::join::join;
use embassy_rp::flash::Flash;
use embassy_rp::gpio::{AnyPin, Input, Level, Output, Pull};
use embassy_rp::i2c::{self, I2c};
use embassy_rp::{Peri, bind_interrupts, peripherals, usb};
use embassy_usb::class::cdc_acm::{CdcAcmClass, State};

use crate::{Board, store_at, scan};

const FLASH_BYTES: usize = 4 << 20;

bind_interrupts!(struct Interrupts {
    I2C0_IRQ => i2c::InterruptHandler<peripherals::I2C0>;
    USBCTRL_IRQ => usb::InterruptHandler<peripherals::USB>;
});

pub(crate) fn reset() -> ! {
    cortex_m::peripheral::SCB::sys_reset()
}

#[embassy_executor::main]
async fn main(_spawner: Spawner) {
    let p = embassy_rp::init(Default::default());
    let (mut buffer, mut state) = ([0; 64], State::new());
    let (mut descriptors, mut control) = ([0; 256], [0; 64]);
    let mut port = embassy_usb::Builder::new(
        usb::Driver::new(p.USB, Interrupts),
        embassy_usb::Config::new(0x2E8A, 0x000A), // Raspberry Pi's serial port; a product needs its own number
        &mut descriptors,
        &mut [],
        &mut [],
        &mut control,
    );
    let (sender, receiver) = CdcAcmClass::new(&mut port, &mut state, 64).split();
    let output = |pin: Peri<'static, AnyPin>| Output::new(pin, Level::Low);
    let input = |pin: Peri<'static, AnyPin>| Input::new(pin, Pull::Up);
    let axis = |step, direction, switch| (output(step), output(direction), input(switch));
    let board = Board {
        axes: [
            axis(p.PIN_6.into(), p.PIN_7.into(), p.PIN_8.into()),
            axis(p.PIN_9.into(), p.PIN_10.into(), p.PIN_11.into()),
            axis(p.PIN_12.into(), p.PIN_13.into(), p.PIN_14.into()),
            axis(p.PIN_15.into(), p.PIN_16.into(), p.PIN_17.into()),
        ],
        lamp: output(p.PIN_18.into()),
        sensor: I2c::new_async(p.I2C0, p.PIN_5, p.PIN_4, Interrupts, Default::default()),
        flash: Flash::<_, _, FLASH_BYTES>::new_blocking(p.FLASH),
        layout: store_at(4032 << 10, 8 << 10),
        line: (receiver.into_buffered(&mut buffer), sender),
        button: input(p.PIN_20.into()),
        light: output(p.PIN_25.into()),
    };
    join(port.build().run(), scan(board)).await;
}

//! Nordic nRF52840-DK. The line is the debugger's serial port over USB.

use defmt_rtt as _; // log
use embassy_executor::Spawner;
use embassy_nrf::buffered_uarte::{self, BufferedUarte};
use embassy_nrf::gpio::{AnyPin, Input, Level, Output, OutputDrive, Pull};
use embassy_nrf::nvmc::Nvmc;
use embassy_nrf::twim::{self, Twim};
use embassy_nrf::{Peri, bind_interrupts, peripherals};

use crate::{Board, store_at, scan};

bind_interrupts!(struct Interrupts {
    TWISPI0 => twim::InterruptHandler<peripherals::TWISPI0>;
    UARTE0 => buffered_uarte::InterruptHandler<peripherals::UARTE0>;
});

pub(crate) fn reset() -> ! {
    cortex_m::peripheral::SCB::sys_reset()
}

#[embassy_executor::main]
async fn main(_spawner: Spawner) {
    let p = embassy_nrf::init(Default::default());
    let (mut received, mut sent, mut bus) = ([0; 256], [0; 256], [0; 16]);
    let port = BufferedUarte::new(
        p.UARTE0,
        p.TIMER1,
        p.PPI_CH0,
        p.PPI_CH1,
        p.PPI_GROUP0,
        p.P0_08,
        p.P0_06,
        Interrupts,
        Default::default(), // 115,200 baud
        &mut received,
        &mut sent,
    );
    let output = |pin: Peri<'static, AnyPin>| Output::new(pin, Level::Low, OutputDrive::Standard);
    let input = |pin: Peri<'static, AnyPin>| Input::new(pin, Pull::Up);
    let axis = |step, direction, switch| (output(step), output(direction), input(switch));
    let board = Board {
        axes: [
            axis(p.P1_01.into(), p.P1_02.into(), p.P1_03.into()),
            axis(p.P1_04.into(), p.P1_05.into(), p.P1_06.into()),
            axis(p.P1_07.into(), p.P1_08.into(), p.P1_10.into()),
            axis(p.P1_11.into(), p.P1_12.into(), p.P1_13.into()),
        ],
        lamp: output(p.P1_14.into()),
        sensor: Twim::new(
            p.TWISPI0,
            Interrupts,
            p.P0_26,
            p.P0_27,
            Default::default(),
            &mut bus,
        ),
        flash: Nvmc::new(p.NVMC),
        layout: store_at(960 << 10, 8 << 10),
        line: port.split(),
        button: input(p.P0_11.into()), // button 1
        light: output(p.P1_15.into()),
    };
    scan(board).await;
}

//! ST Nucleo-F446RE. The line is the ST-LINK's serial port over USB.

use defmt_rtt as _; // log
use embassy_executor::Spawner;
use embassy_stm32::exti::{self, ExtiInput};
use embassy_stm32::flash::Flash;
use embassy_stm32::gpio::{AnyPin, Input, Level, Output, Pull, Speed};
use embassy_stm32::i2c::{self, I2c};
use embassy_stm32::usart::{self, BufferedUart};
use embassy_stm32::{Peri, bind_interrupts, dma, interrupt, peripherals, rcc};

use crate::{Board, store_at, scan};

bind_interrupts!(struct Interrupts {
    I2C1_EV => i2c::EventInterruptHandler<peripherals::I2C1>;
    I2C1_ER => i2c::ErrorInterruptHandler<peripherals::I2C1>;
    DMA1_STREAM6 => dma::InterruptHandler<peripherals::DMA1_CH6>;
    DMA1_STREAM0 => dma::InterruptHandler<peripherals::DMA1_CH0>;
    USART2 => usart::BufferedInterruptHandler<peripherals::USART2>;
    EXTI15_10 => exti::InterruptHandler<interrupt::typelevel::EXTI15_10>;
});

pub(crate) fn reset() -> ! {
    cortex_m::peripheral::SCB::sys_reset()
}

#[embassy_executor::main]
async fn main(_spawner: Spawner) {
    let mut config = embassy_stm32::Config::default();
    config.rcc.pll_src = rcc::PllSource::HSI;
    config.rcc.pll = Some(rcc::Pll {
        prediv: rcc::PllPreDiv::DIV8,
        mul: rcc::PllMul::MUL168,
        divp: Some(rcc::PllPDiv::DIV2), // 168 MHz
        divq: None,
        divr: None,
    });
    config.rcc.sys = rcc::Sysclk::PLL1_P;
    config.rcc.apb1_pre = rcc::APBPrescaler::DIV4;
    config.rcc.apb2_pre = rcc::APBPrescaler::DIV2;
    let p = embassy_stm32::init(config);
    let (mut received, mut sent) = ([0; 256], [0; 256]);
    let settings = Default::default(); // 115,200 baud
    let port = BufferedUart::new(
        p.USART2,
        p.PA3,
        p.PA2,
        &mut sent,
        &mut received,
        Interrupts,
        settings,
    );
    let Ok(port) = port else {
        return defmt::error!("the UART does not start");
    };
    let (sender, receiver) = port.split();
    let output = |pin: Peri<'static, AnyPin>| Output::new(pin, Level::Low, Speed::Low);
    let input = |pin: Peri<'static, AnyPin>| Input::new(pin, Pull::Up);
    let axis = |step, direction, switch| (output(step), output(direction), input(switch));
    let board = Board {
        axes: [
            axis(p.PA0.into(), p.PA1.into(), p.PA4.into()),
            axis(p.PB0.into(), p.PC1.into(), p.PC0.into()),
            axis(p.PA10.into(), p.PB3.into(), p.PB5.into()),
            axis(p.PB10.into(), p.PB4.into(), p.PA8.into()),
        ],
        lamp: output(p.PA9.into()),
        sensor: I2c::new(
            p.I2C1,
            p.PB8,
            p.PB9,
            p.DMA1_CH6,
            p.DMA1_CH0,
            Interrupts,
            Default::default(),
        ),
        flash: Flash::new_blocking(p.FLASH)
            .into_blocking_regions()
            .bank1_region1,
        layout: store_at(16 << 10, 16 << 10),
        line: (receiver, sender),
        button: ExtiInput::new(p.PC13, p.EXTI13, Pull::Up, Interrupts), // the blue one
        light: output(p.PA5.into()),
    };
    scan(board).await;
}

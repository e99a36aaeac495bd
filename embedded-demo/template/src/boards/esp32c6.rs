//! Espressif ESP32-C6-DevKitC. The line is the USB port UART, the log is at the port USB.

use embassy_executor::Spawner;
use esp_hal::gpio::{AnyPin, Input, InputConfig, Level, Output, Pull};
use esp_hal::i2c::master::I2c;
use esp_hal::timer::timg::TimerGroup;
use esp_hal::uart::Uart;
use esp_println as _; // log
use esp_storage::FlashStorage;

use crate::{Board, store_at, scan};

esp_bootloader_esp_idf::esp_app_desc!();

pub(crate) fn reset() -> ! {
    esp_hal::system::software_reset()
}

#[esp_rtos::main]
async fn main(_spawner: Spawner) {
    let p = esp_hal::init(Default::default());
    esp_rtos::start(TimerGroup::new(p.TIMG0).timer0, p.FROM_CPU_INTR0);
    let output = |pin: AnyPin<'static>| Output::new(pin, Level::Low, Default::default());
    let pull_up = InputConfig::default().with_pull(Pull::Up);
    let input = |pin: AnyPin<'static>| Input::new(pin, pull_up);
    let axis = |step, direction, switch| (output(step), output(direction), input(switch));
    let bus = I2c::new(p.I2C0, Default::default());
    let port = Uart::new(p.UART0, Default::default()); // 115,200 baud
    let (Ok(bus), Ok(port)) = (bus, port) else {
        return defmt::error!("the bus or the UART does not start");
    };
    let port = port.with_rx(p.GPIO17).with_tx(p.GPIO16).into_async();
    let board = Board {
        axes: [
            axis(p.GPIO0.into(), p.GPIO1.into(), p.GPIO2.into()),
            axis(p.GPIO3.into(), p.GPIO4.into(), p.GPIO5.into()),
            axis(p.GPIO6.into(), p.GPIO7.into(), p.GPIO10.into()),
            axis(p.GPIO18.into(), p.GPIO19.into(), p.GPIO11.into()),
        ],
        lamp: output(p.GPIO20.into()),
        sensor: bus.with_sda(p.GPIO22).with_scl(p.GPIO23).into_async(),
        flash: FlashStorage::new(p.FLASH),
        layout: store_at(0x9000, 8 << 10), // the partition nvs
        line: port.split(),
        button: input(p.GPIO9.into()), // BOOT
        light: output(p.GPIO21.into()),
    };
    scan(board).await;
}

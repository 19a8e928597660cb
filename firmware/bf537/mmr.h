// SPDX-License-Identifier: Apache-2.0
/// Memory-mapped registers of the ADSP-BF537 that the firmware uses, by their names in the
/// "ADSP-BF537 Blackfin Processor Hardware Reference" (Analog Devices, revision 3.4), appendix B.
#ifndef VERGENCE_BF537_MMR_H
#define VERGENCE_BF537_MMR_H

#include <stdint.h>

#define MMR16(address) (*(volatile uint16_t *)(uintptr_t)(address))
#define MMR32(address) (*(volatile uint32_t *)(uintptr_t)(address))

// Clocks and reset
#define PLL_CTL MMR16(0xFFC00000)
#define PLL_DIV MMR16(0xFFC00004)
enum { PLL_HALF_INPUT = 1, PLL_BYPASS = 0x100, PLL_MULTIPLIER_SHIFT = 9, PLL_MULTIPLIER_MASK = 63 };
#define SWRST MMR16(0xFFC00100)
enum { SWRST_BY_DOUBLE_FAULT = 1 << 3, SWRST_DOUBLE_FAULT = 1 << 13, SWRST_WATCHDOG = 1 << 14 };

// System interrupt controller
#define SIC_IMASK MMR32(0xFFC0010C)
#define SIC_IAR(n) MMR32(0xFFC00110u + 4u * (uint32_t)(n))
#define SIC_IWR MMR32(0xFFC00124)
enum { SIC_UART0_RX = 11, SIC_UART0_TX = 12, SIC_UART1_RX = 13, SIC_UART1_TX = 14 };

// Watchdog
#define WDOG_CTL MMR16(0xFFC00200)
#define WDOG_CNT MMR32(0xFFC00204)
#define WDOG_STAT MMR32(0xFFC00208)
enum { WDOG_RESETS = 0x0000, WDOG_OFF = 0x0AD6 };

// UARTs
enum { UART0 = 0x0400, UART1 = 0x2000 };  ///< offset of the registers of a UART
#define UART_BASE(uart) (0xFFC00000 + (uint32_t)(uart))
#define UART_THR(uart) MMR16(UART_BASE(uart) + 0x00)
#define UART_RBR(uart) MMR16(UART_BASE(uart) + 0x00)
#define UART_DLL(uart) MMR16(UART_BASE(uart) + 0x00)
#define UART_DLH(uart) MMR16(UART_BASE(uart) + 0x04)
#define UART_IER(uart) MMR16(UART_BASE(uart) + 0x04)
#define UART_LCR(uart) MMR16(UART_BASE(uart) + 0x0C)
#define UART_LSR(uart) MMR16(UART_BASE(uart) + 0x14)
#define UART_GCTL(uart) MMR16(UART_BASE(uart) + 0x24)
enum { UART_IER_ERBFI = 1 };
enum { UART_LCR_8N1 = 0x03, UART_LCR_DLAB = 0x80 };
enum { UART_LSR_DR = 0x01, UART_LSR_OE = 0x02, UART_LSR_THRE = 0x20 };
enum { UART_GCTL_UCEN = 1 };

// Ports: F and G
#define PORTGIO MMR16(0xFFC01500)
#define PORTGIO_CLEAR MMR16(0xFFC01504)
#define PORTGIO_SET MMR16(0xFFC01508)
#define PORTGIO_DIR MMR16(0xFFC01530)
#define PORTGIO_INEN MMR16(0xFFC01540)
#define PORTF_FER MMR16(0xFFC03200)
#define PORTG_FER MMR16(0xFFC03204)

// Asynchronous memory
#define EBIU_AMGCTL MMR16(0xFFC00A00)
enum { AMGCTL_ALL_BANKS = 0x000E };

// Two-wire interface
#define TWI_CLKDIV MMR16(0xFFC01400)
#define TWI_CONTROL MMR16(0xFFC01404)
#define TWI_MASTER_CTL MMR16(0xFFC01414)
#define TWI_MASTER_STAT MMR16(0xFFC01418)
#define TWI_MASTER_ADDR MMR16(0xFFC0141C)
#define TWI_INT_STAT MMR16(0xFFC01420)
#define TWI_INT_MASK MMR16(0xFFC01424)
#define TWI_FIFO_CTL MMR16(0xFFC01428)
#define TWI_FIFO_STAT MMR16(0xFFC0142C)
#define TWI_XMT_DATA8 MMR16(0xFFC01480)
#define TWI_RCV_DATA8 MMR16(0xFFC01488)
enum { TWI_CONTROL_ENABLE = 0x80 };
enum {
    TWI_MASTER_ENABLE = 0x0001,
    TWI_MASTER_RECEIVE = 0x0004,
    TWI_MASTER_FAST = 0x0008,
    TWI_MASTER_STOP = 0x0010,
    TWI_MASTER_RESTART = 0x0020,
    TWI_MASTER_COUNT = 0x0040,  ///< one byte of the count of bytes; 255 of them: until STOP
    TWI_MASTER_PULL_SDA = 0x4000,
    TWI_MASTER_PULL_SCL = 0x8000,
};
enum {
    TWI_STAT_RUNS = 0x0001,
    TWI_STAT_BUS_BUSY = 0x0100,
    TWI_STAT_LOST = 0x0002,
    TWI_STAT_NACK_ADDRESS = 0x0004,
    TWI_STAT_NACK_DATA = 0x0008,
    TWI_STAT_READ_ERROR = 0x0010,
    TWI_STAT_WRITE_ERROR = 0x0020,
    TWI_STAT_SDA_LOW = 0x0040,
    TWI_STAT_SCL_LOW = 0x0080,
    TWI_STAT_ERRORS = TWI_STAT_LOST | TWI_STAT_NACK_ADDRESS | TWI_STAT_NACK_DATA |
                      TWI_STAT_READ_ERROR | TWI_STAT_WRITE_ERROR,
};
enum {
    TWI_INT_COMPLETE = 0x10,
    TWI_INT_ERROR = 0x20,
    TWI_INT_TRANSMIT = 0x40,
    TWI_INT_RECEIVE = 0x80
};
enum { TWI_FIFO_FLUSH = 3 };
enum { TWI_FIFO_TRANSMIT_FULL = 3, TWI_FIFO_RECEIVED = 0x0C };

// Parallel peripheral interface and its DMA channel
#define PPI_CONTROL MMR16(0xFFC01000)
#define PPI_STATUS MMR16(0xFFC01004)
#define PPI_COUNT MMR16(0xFFC01008)
#define PPI_FRAME MMR16(0xFFC01010)
enum {
    PPI_ENABLE = 0x0001,
    PPI_NO_ITU = 0x000C,     ///< XFR_TYPE 3
    PPI_TWO_SYNCS = 0x0010,  ///< PORT_CFG 1: FS1 begins a line, FS2 a frame
    PPI_10_BITS = 0x0800,    ///< DLEN 1
};
enum { PPI_OVERFLOW = 0x1000, PPI_FRAME_ERROR = 0x0800, PPI_LINE_ERROR = 0x0300 };
#define DMA0_START_ADDR MMR32(0xFFC00C04)
#define DMA0_CONFIG MMR16(0xFFC00C08)
#define DMA0_X_COUNT MMR16(0xFFC00C10)
#define DMA0_X_MODIFY MMR16(0xFFC00C14)
#define DMA0_Y_COUNT MMR16(0xFFC00C18)
#define DMA0_Y_MODIFY MMR16(0xFFC00C1C)
#define DMA0_IRQ_STATUS MMR16(0xFFC00C28)
enum {
    DMA_ENABLE = 1,
    DMA_TO_MEMORY = 2,
    DMA_16_BITS = 4,
    DMA_32_BITS = 8,
    DMA_2D = 0x10,
    DMA_INTERRUPT = 0x80
};
enum { DMA_DONE = 1, DMA_ERROR = 2 };

// DMA from memory (S0) to memory (D0)
#define MDMA_D0_START_ADDR MMR32(0xFFC00F04)
#define MDMA_D0_CONFIG MMR16(0xFFC00F08)
#define MDMA_D0_X_COUNT MMR16(0xFFC00F10)
#define MDMA_D0_X_MODIFY MMR16(0xFFC00F14)
#define MDMA_D0_IRQ_STATUS MMR16(0xFFC00F28)
#define MDMA_S0_START_ADDR MMR32(0xFFC00F44)
#define MDMA_S0_CONFIG MMR16(0xFFC00F48)
#define MDMA_S0_X_COUNT MMR16(0xFFC00F50)
#define MDMA_S0_X_MODIFY MMR16(0xFFC00F54)

// Core: data cache, events and timer
#define DMEM_CONTROL MMR32(0xFFE00004)
enum { DMEM_CACHED = 0x0C };  ///< one of both banks, or both, are a cache
#define IPEND MMR32(0xFFE02108)
#define TCNTL MMR32(0xFFE03000)
#define TPERIOD MMR32(0xFFE03004)
#define TSCALE MMR32(0xFFE03008)
#define TCOUNT MMR32(0xFFE0300C)
enum { TCNTL_POWER = 1, TCNTL_ENABLE = 2 };
enum { IVG_EXCEPTION = 3, IVG_HARDWARE_ERROR = 5, IVG_TIMER = 6, IVG_DEVICES = 10, IVG_MAIN = 15 };

/// Waits until writes to registers of the system have taken effect.
static inline void ssync(void) {
    __asm__ volatile("ssync;" ::: "memory");
}

#endif

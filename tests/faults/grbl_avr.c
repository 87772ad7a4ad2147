/* GRBL as it runs on an ATmega328P, simulated by simavr, at the pace of the clock on the wall.
 *
 *     grbl_avr FIRMWARE.elf EEPROM PORT
 *
 * The serial line is a TCP port of this machine, at its real speed; the EEPROM is a file. Letters at
 * the standard input turn switches over, as at grblHAL's simulator: x is the limit of X, d the
 * safety door. It ends when its input or its line ends. `docs/firmware.md` says how to use it. */

#include <arpa/inet.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#include <simavr/avr_eeprom.h>
#include <simavr/avr_ioport.h>
#include <simavr/avr_uart.h>
#include <simavr/sim_avr.h>
#include <simavr/sim_elf.h>

#define HZ 4000000ull
#define BYTE_CYCLES (HZ * 10 / 115200)
#define SLICE_CYCLES (HZ / 1000)
#define LATE_CYCLES HZ /* A computer that was busy for longer has lost time for good. */
#define EEPROM_BYTES 1024
#define OCR1AH 0x89

static avr_t *avr;
static uint8_t out[4096];
static size_t out_count;

static void die(const char *what)
{
    fprintf(stderr, "grbl_avr: %s\n", what);
    exit(1);
}

static void said(struct avr_irq_t *irq, uint32_t byte, void *unused)
{
    (void)irq, (void)unused;
    if (out_count == sizeof out)
        die("it says more than the line can carry");
    out[out_count++] = byte;
}

/* Switches are open and pulled up; a closed one is at 0 V. */
static void set_pins(char port, uint8_t levels)
{
    avr_ioport_external_t external = {.name = port, .mask = 0x3f, .value = levels};

    avr_ioctl(avr, AVR_IOCTL_IOPORT_SET_EXTERNAL(port), &external);
    for (int pin = 0; pin < 6; pin++)
        avr_raise_irq(avr_io_getirq(avr, AVR_IOCTL_IOPORT_GETIRQ(port), pin), levels >> pin & 1);
}

static void press(char key)
{
    static uint8_t limits = 0x3f, controls = 0x3f;

    if (key == 'x')
        set_pins('B', limits ^= 1 << 1);
    if (key == 'd')
        set_pins('C', controls ^= 1 << 1);
}

static void keep_eeprom(const char *path)
{
    static uint8_t kept[EEPROM_BYTES];
    uint8_t now[EEPROM_BYTES];
    avr_eeprom_desc_t all = {.ee = now, .offset = 0, .size = sizeof now};
    FILE *file;

    avr_ioctl(avr, AVR_IOCTL_EEPROM_GET, &all);
    if (memcmp(now, kept, sizeof now) == 0)
        return;
    memcpy(kept, now, sizeof now);
    if (!(file = fopen(path, "wb")) || fwrite(now, sizeof now, 1, file) != 1 || fclose(file))
        die("cannot write the EEPROM");
}

static void load_eeprom(const char *path)
{
    uint8_t bytes[EEPROM_BYTES];
    avr_eeprom_desc_t all = {.ee = bytes, .offset = 0, .size = sizeof bytes};
    FILE *file = fopen(path, "rb");

    if (!file)
        return; /* It is new. */
    if (fread(bytes, sizeof bytes, 1, file) == 1)
        avr_ioctl(avr, AVR_IOCTL_EEPROM_SET, &all);
    fclose(file);
}

static void start(const char *path, const char *eeprom)
{
    static elf_firmware_t firmware;
    uint32_t flags = 0;

    if (elf_read_firmware(path, &firmware) != 0)
        die("cannot read the firmware");
    if (!(avr = avr_make_mcu_by_name("atmega328p")))
        die("this simavr has no atmega328p");
    avr_init(avr);
    firmware.frequency = HZ;
    avr_load_firmware(avr, &firmware);
    /* GRBL's first step is due when its timer comes to 0. That is at once at an ATmega, but never
     * at simavr's. */
    avr->data[OCR1AH] = 1;
    avr_ioctl(avr, AVR_IOCTL_UART_SET_FLAGS('0'), &flags);
    avr_irq_register_notify(
        avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_OUTPUT), said, NULL);
    set_pins('B', 0x3f);
    set_pins('C', 0x3f);
    load_eeprom(eeprom);
}

static int connected(int port)
{
    struct sockaddr_in here = {.sin_family = AF_INET, .sin_port = htons(port)};
    int listener = socket(AF_INET, SOCK_STREAM, 0), line;

    here.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    if (bind(listener, (struct sockaddr *)&here, sizeof here) || listen(listener, 1))
        die("cannot listen");
    if ((line = accept(listener, NULL, NULL)) < 0)
        die("nobody connects");
    close(listener);
    return line;
}

static void run_until(avr_cycle_count_t end, const uint8_t *in, size_t count)
{
    static avr_cycle_count_t next_byte;
    avr_irq_t *input = avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_INPUT);
    int state;

    while (avr->cycle < end || count > 0) {
        if (count > 0 && avr->cycle >= next_byte) {
            avr_raise_irq(input, *in++);
            count--;
            next_byte = avr->cycle + BYTE_CYCLES;
        }
        state = avr_run(avr);
        if (state == cpu_Done || state == cpu_Crashed)
            die("the processor has crashed");
    }
}

static avr_cycle_count_t wall_cycles(void)
{
    struct timespec now;

    clock_gettime(CLOCK_MONOTONIC, &now);
    return now.tv_sec * HZ + now.tv_nsec * (HZ / 1000000) / 1000;
}

/* Takes what has come, waiting for it at most a millisecond. */
static size_t received(int line, uint8_t *in, size_t size, int wait_ms)
{
    struct pollfd ends[] = {{.fd = line, .events = POLLIN}, {.fd = 0, .events = POLLIN}};
    ssize_t count = 0;
    char key;

    poll(ends, 2, wait_ms);
    if (ends[1].revents) {
        if (read(0, &key, 1) != 1)
            exit(0);
        press(key);
    }
    if (ends[0].revents && (count = read(line, in, size)) <= 0)
        exit(0);
    return count;
}

int main(int argc, char **argv)
{
    uint8_t in[16];
    size_t count = 0;
    avr_cycle_count_t zero, due;
    int line;

    if (argc != 4)
        die("usage: grbl_avr FIRMWARE.elf EEPROM PORT");
    start(argv[1], argv[2]);
    line = connected(atoi(argv[3]));
    zero = wall_cycles();
    for (;;) {
        due = wall_cycles() - zero;
        if (due > avr->cycle + LATE_CYCLES)
            zero += due - avr->cycle - LATE_CYCLES;
        /* What comes is looked at after each slice, also when there is much to make up for. */
        if (due > avr->cycle + SLICE_CYCLES)
            due = avr->cycle + SLICE_CYCLES;
        run_until(due, in, count);
        keep_eeprom(argv[2]);
        if (out_count && write(line, out, out_count) != (ssize_t)out_count)
            exit(0);
        out_count = 0;
        count = received(line, in, sizeof in, avr->cycle >= wall_cycles() - zero ? 1 : 0);
    }
}

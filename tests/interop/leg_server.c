/* A leg on libmodbus: two drives (units 1, 2) and four force sensors (units 11 to 14) with the registers of
 * datasets/rigs/plain.toml, written from the register map alone. It shares no code with exoid.
 *
 * In lockstep, as that rig: a sample lasts until both drives have been exchanged (FC23). The joints are where their
 * set-points are; every other number follows from the angle or the sample's number by a formula that the tests know.
 * Listens on a free port, prints it, and serves until its input ends.
 */
#include <arpa/inet.h>
#include <errno.h>
#include <modbus.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>
#include <sys/select.h>
#include <unistd.h>

enum { DRIVES = 2, SENSORS = 4, DEVICES = DRIVES + SENSORS, READ = 100, WRITE = 200, REGISTERS = 203 };
enum { ENABLE = 0x000F, READ_WRITE = 23, PERIOD_US = 5000 };

static const int UNIT[DEVICES] = {1, 2, 11, 12, 13, 14};
static modbus_mapping_t *map[DEVICES];
static int32_t angle[DRIVES], last_angle[DRIVES]; /* microradians */
static int exchanged[DRIVES];
static uint32_t sample = UINT32_MAX - 350, clock_us = UINT32_MAX - 1000000; /* both turn over within a run */

static void put32(uint16_t *at, uint32_t value) {
    at[0] = value >> 16;
    at[1] = value & 0xFFFF;
}

/* By hand: libmodbus 3.1.6 swaps the bytes of each word in modbus_set_float_abcd on a little-endian machine. */
static void put_float(uint16_t *at, float value) {
    uint32_t bits;
    memcpy(&bits, &value, sizeof bits);
    put32(at, bits);
}

/* Halted, a drive is enabled still. */
static int is_enabled(int j) {
    return (map[j]->tab_registers[WRITE + 2] & ENABLE) == ENABLE;
}

static void latch(void) {
    sample += 1;
    clock_us += PERIOD_US;
    for (int j = 0; j < DRIVES; j++) {
        uint16_t *written = map[j]->tab_registers + WRITE;
        last_angle[j] = angle[j];
        if (is_enabled(j))
            angle[j] = (int32_t)((uint32_t)written[0] << 16 | written[1]);
        exchanged[j] = 0;
    }
}

static void show_drive(int j) {
    uint16_t *at = map[j]->tab_registers + READ;
    put32(at, sample);
    put32(at + 2, clock_us);
    put32(at + 4, (uint32_t)angle[j]);
    put32(at + 6, (uint32_t)((angle[j] - last_angle[j]) * 20)); /* 200 samples a second, in 1e-5 rad/s */
    put32(at + 8, (uint32_t)(angle[j] / 50 + 1000));            /* 0.1 mA */
    put32(at + 10, (uint32_t)angle[j]);
    at[12] = 250 + sample % 10; /* 0.1 degrees Celsius */
    at[13] = (uint16_t)is_enabled(j);
}

static void show_sensor(int device) {
    uint16_t *at = map[device]->tab_registers + READ;
    put32(at, sample);
    put_float(at + 2, (float)UNIT[device]);
    put_float(at + 4, (float)(angle[0] * 1e-5));
    put_float(at + 6, (float)(sample % 100));
}

static int device_of(int unit) {
    for (int i = 0; i < DEVICES; i++)
        if (UNIT[i] == unit)
            return i;
    return -1;
}

/* Answer one request; libmodbus writes, then reads, where a request does both. */
static void answer(modbus_t *server, const uint8_t *query, int length) {
    int header = modbus_get_header_length(server);
    int device = device_of(query[header - 1]), function = query[header];
    if (device < 0) {
        modbus_reply_exception(server, query, MODBUS_EXCEPTION_GATEWAY_TARGET);
        return;
    }
    if (exchanged[0] && exchanged[1])
        latch();
    if (device < DRIVES)
        show_drive(device);
    else
        show_sensor(device);
    modbus_reply(server, query, length, map[device]);
    if (device < DRIVES && function == READ_WRITE)
        exchanged[device] = 1;
}

static void make_devices(void) {
    for (int i = 0; i < DEVICES; i++) {
        map[i] = modbus_mapping_new(0, 0, REGISTERS, 0);
        map[i]->tab_registers[0] = i < DRIVES ? 0x4558 : 0x4653;
        map[i]->tab_registers[1] = 2;
    }
}

static void serve(modbus_t *server, int listening) {
    uint8_t query[MODBUS_TCP_MAX_ADU_LENGTH];
    fd_set watched, ready;
    FD_ZERO(&watched);
    FD_SET(listening, &watched);
    FD_SET(STDIN_FILENO, &watched);
    for (;;) {
        ready = watched;
        if (select(FD_SETSIZE, &ready, NULL, NULL, NULL) < 0 || FD_ISSET(STDIN_FILENO, &ready))
            return;
        for (int fd = 0; fd < FD_SETSIZE; fd++) {
            if (!FD_ISSET(fd, &ready))
                continue;
            if (fd == listening) {
                int client = modbus_tcp_accept(server, &listening);
                FD_SET(client, &watched);
                continue;
            }
            modbus_set_socket(server, fd);
            int length = modbus_receive(server, query);
            if (length > 0) {
                answer(server, query, length);
            } else if (length < 0) {
                close(fd);
                FD_CLR(fd, &watched);
            }
        }
    }
}

int main(void) {
    struct sockaddr_in where;
    socklen_t size = sizeof where;
    modbus_t *server = modbus_new_tcp("127.0.0.1", 0);
    int listening = modbus_tcp_listen(server, DEVICES + 4);
    if (listening < 0 || getsockname(listening, (struct sockaddr *)&where, &size) < 0) {
        fprintf(stderr, "cannot listen: %s\n", modbus_strerror(errno));
        return 1;
    }
    printf("%d\n", ntohs(where.sin_port));
    fflush(stdout);
    make_devices();
    latch();
    serve(server, listening);
    return 0;
}

/* A stand-in of libuldaq for tests: the functions of the public header uldaq.h that a scan of analog inputs needs, on
   devices that are not there. No thread and no clock: a test passes the time. The others return ERR_INTERNAL. */
#include <stddef.h>
#include <string.h>

enum { NO_ERROR = 0, BAD_DEV_HANDLE = 2, DEV_NOT_CONNECTED = 7, BAD_BUFFER = 10, BAD_RANGE = 13, BAD_AI_CHAN = 14,
       ALREADY_ACTIVE = 16, BAD_OPTION = 21, BAD_INFO_ITEM = 32, INTERNAL = 35, BAD_NET_HOST = 95 };
enum { CONTINUOUS = 1 << 3, IDLE = 0, RUNNING = 1, DIFFERENTIAL = 1, HANDLE = 7 };
enum { USB = 1, ETHERNET = 4 };

struct descriptor {
    char product_name[64];
    unsigned product_id;
    unsigned interface;
    char text[64];
    char unique_id[64];
    char reserved[512];
};

struct transfer {
    unsigned long long scans;
    unsigned long long samples;
    long long index;
    char reserved[64];
};

static struct {
    int devices, failure, connect_error, has_inputs, has_pacer, handles, connected;
    double constant_v, rate_share;
} unit;

static struct {
    int running, low, inputs, samples, range, mode;
    unsigned long long scans;
    double hz, due;
    double *data;
} scan;

void stand_in_reset(int devices)
{
    memset(&unit, 0, sizeof unit);
    memset(&scan, 0, sizeof scan);
    unit.devices = devices;
    unit.has_inputs = unit.has_pacer = 1;
    unit.rate_share = 1.0;
}

void stand_in_inputs(int has_inputs, int has_pacer) { unit.has_inputs = has_inputs; unit.has_pacer = has_pacer; }
void stand_in_volts(double volts) { unit.constant_v = volts; }
void stand_in_rate(double share) { unit.rate_share = share; }
void stand_in_connect_error(int error) { unit.connect_error = error; }
int stand_in_handles(void) { return unit.handles; }
int stand_in_setting(int which)
{
    const int settings[] = {scan.low, scan.inputs, scan.samples, scan.range, scan.mode, scan.running};
    return settings[which];
}

/* A scan ends with an error, as after a full memory of the device, or after it was unplugged. */
void stand_in_fail(int error) { unit.failure = error; scan.running = 0; }

/* Volts of scan n at an input; a test computes the same. */
static double volts(unsigned long long n, int input)
{
    return unit.constant_v != 0.0 ? unit.constant_v : 0.1 * input + 0.001 * (double)(n % 1000);
}

void stand_in_pass(double seconds)
{
    if (!scan.running)
        return;
    for (scan.due += seconds * scan.hz; scan.due >= 0.9999; scan.due -= 1.0) {
        double *place = scan.data + (scan.scans % (unsigned long long)scan.samples) * (unsigned long long)scan.inputs;
        for (int input = 0; input < scan.inputs; input++)
            place[input] = volts(scan.scans, scan.low + input);
        scan.scans++;
    }
}

static void describe(struct descriptor *into, int number, unsigned interface)
{
    memset(into, 0, sizeof *into);
    strcpy(into->product_name, interface == ETHERNET ? "E-1608" : "USB-1608G");
    into->interface = interface;
    strcpy(into->unique_id, "01E3A2B0");
    into->unique_id[7] = (char)('0' + number);
}

int ulGetDaqDeviceInventory(unsigned interfaces, struct descriptor *found, unsigned *count)
{
    int devices = interfaces & USB ? unit.devices : 0;
    for (int n = 0; n < devices && n < (int)*count; n++)
        describe(found + n, n, USB);
    *count = (unsigned)devices;
    return NO_ERROR;
}

int ulGetNetDaqDeviceDescriptor(const char *host, unsigned short port, const char *card, struct descriptor *found, double s)
{
    (void)card;
    if (strcmp(host, "10.0.0.9") != 0 || port != 54211 || s < 0)
        return BAD_NET_HOST;
    describe(found, 0, ETHERNET);
    return NO_ERROR;
}

static struct descriptor given;

long long ulCreateDaqDevice(struct descriptor wanted)
{
    if (unit.devices < 0)   /* the descriptor is of no device that the library knows */
        return 0;
    given = wanted;
    unit.handles++;
    return HANDLE;
}

int ulReleaseDaqDevice(long long handle)
{
    if (handle != HANDLE)
        return BAD_DEV_HANDLE;
    unit.handles--;
    return NO_ERROR;
}

int ulGetDaqDeviceDescriptor(long long handle, struct descriptor *into)
{
    *into = given;
    return handle == HANDLE ? NO_ERROR : BAD_DEV_HANDLE;
}

int ulDaqDeviceConnectionCode(long long handle, long long code) { return handle == HANDLE && !code ? NO_ERROR : INTERNAL; }

int ulConnectDaqDevice(long long handle)
{
    if (handle != HANDLE)
        return BAD_DEV_HANDLE;
    unit.connected = !unit.connect_error;
    return unit.connect_error;
}

int ulIsDaqDeviceConnected(long long handle, int *connected)
{
    *connected = unit.connected;
    return handle == HANDLE ? NO_ERROR : BAD_DEV_HANDLE;
}

int ulDisconnectDaqDevice(long long handle)
{
    unit.connected = 0;
    return handle == HANDLE ? NO_ERROR : BAD_DEV_HANDLE;
}

int ulDevGetInfo(long long handle, unsigned item, unsigned index, long long *value)
{
    (void)index;
    *value = item == 1 ? unit.has_inputs : 0;   /* 1: has analog inputs */
    return handle == HANDLE ? NO_ERROR : BAD_DEV_HANDLE;
}

int ulAIGetInfo(long long handle, unsigned item, unsigned index, long long *value)
{
    static const int ranges[] = {5, 6, 9, 11};   /* 10, 5, 2 and 1 V with both signs */
    if (handle != HANDLE)
        return BAD_DEV_HANDLE;
    switch (item) {
    case 3: *value = index == DIFFERENTIAL ? 8 : 16; return NO_ERROR;   /* inputs by mode */
    case 7: *value = unit.has_pacer; return NO_ERROR;
    case 8: case 9: *value = 4; return NO_ERROR;                        /* ranges */
    case 10: case 11: *value = ranges[index % 4]; return NO_ERROR;
    default: return BAD_INFO_ITEM;
    }
}

int ulAInScan(long long handle, int low, int high, unsigned mode, unsigned range, int samples, double *rate,
              unsigned options, unsigned flags, double *data)
{
    if (handle != HANDLE || !unit.connected)
        return handle != HANDLE ? BAD_DEV_HANDLE : DEV_NOT_CONNECTED;
    if (scan.running)
        return ALREADY_ACTIVE;
    if (low < 0 || high < low || high >= (mode == DIFFERENTIAL ? 8 : 16))
        return BAD_AI_CHAN;
    if (range != 5 && range != 6 && range != 9 && range != 11)
        return BAD_RANGE;
    if (options != CONTINUOUS || flags || data == NULL)
        return data == NULL ? BAD_BUFFER : BAD_OPTION;
    unit.failure = NO_ERROR;
    *rate *= unit.rate_share;
    memset(&scan, 0, sizeof scan);
    scan.running = 1;
    scan.low = low;
    scan.inputs = high - low + 1;
    scan.samples = samples;
    scan.range = (int)range;
    scan.mode = (int)mode;
    scan.hz = *rate;
    scan.data = data;
    return NO_ERROR;
}

int ulAInScanStatus(long long handle, unsigned *status, struct transfer *transfer)
{
    if (handle != HANDLE)
        return BAD_DEV_HANDLE;
    *status = scan.running ? RUNNING : IDLE;
    transfer->scans = scan.scans;
    transfer->samples = scan.scans * (unsigned long long)scan.inputs;
    transfer->index = scan.scans ? (long long)((scan.scans - 1) % (unsigned long long)scan.samples) * scan.inputs : -1;
    return scan.running ? NO_ERROR : unit.failure;
}

int ulAInScanStop(long long handle)
{
    scan.running = 0;
    return handle == HANDLE ? unit.failure : BAD_DEV_HANDLE;
}

int ulGetErrMsg(unsigned error, char *text)
{
    const char *known = error == 4 ? "Insufficient permission to access this device"
        : error == 8 ? "Device no longer responding"
        : error == 18 ? "FIFO overrun, data was not transferred from device fast enough"
        : error == BAD_NET_HOST ? "Invalid host" : "Another error";
    strcpy(text, known);
    return NO_ERROR;
}

/* The package declares these when it is imported; no test calls them. */
#define ABSENT(name) int name(void) { return INTERNAL; }
ABSENT(ulAIGetConfig) ABSENT(ulAIGetConfigDbl) ABSENT(ulAIGetConfigStr) ABSENT(ulAIGetInfoDbl)
ABSENT(ulAISetConfig) ABSENT(ulAISetConfigDbl) ABSENT(ulAIn) ABSENT(ulAInLoadQueue) ABSENT(ulAInScanWait)
ABSENT(ulAInSetTrigger) ABSENT(ulAOGetInfo) ABSENT(ulAOGetInfoDbl) ABSENT(ulAOut) ABSENT(ulAOutArray)
ABSENT(ulAOutScan) ABSENT(ulAOutScanStatus) ABSENT(ulAOutScanStop) ABSENT(ulAOutScanWait) ABSENT(ulAOutSetTrigger)
ABSENT(ulCClear) ABSENT(ulCConfigScan) ABSENT(ulCIn) ABSENT(ulCInScan) ABSENT(ulCInScanStatus)
ABSENT(ulCInScanStop) ABSENT(ulCInScanWait) ABSENT(ulCInSetTrigger) ABSENT(ulCLoad) ABSENT(ulCRead)
ABSENT(ulCtrGetConfig) ABSENT(ulCtrGetInfo) ABSENT(ulCtrGetInfoDbl) ABSENT(ulCtrSetConfig) ABSENT(ulDBitIn)
ABSENT(ulDBitOut) ABSENT(ulDConfigBit) ABSENT(ulDConfigPort) ABSENT(ulDIOGetConfig) ABSENT(ulDIOGetInfo)
ABSENT(ulDIOGetInfoDbl) ABSENT(ulDIOSetConfig) ABSENT(ulDIn) ABSENT(ulDInArray) ABSENT(ulDInScan)
ABSENT(ulDInScanStatus) ABSENT(ulDInScanStop) ABSENT(ulDInScanWait) ABSENT(ulDInSetTrigger) ABSENT(ulDOut)
ABSENT(ulDOutArray) ABSENT(ulDOutScan) ABSENT(ulDOutScanStatus) ABSENT(ulDOutScanStop) ABSENT(ulDOutScanWait)
ABSENT(ulDOutSetTrigger) ABSENT(ulDaqIGetInfo) ABSENT(ulDaqIGetInfoDbl) ABSENT(ulDaqInScan)
ABSENT(ulDaqInScanStatus) ABSENT(ulDaqInScanStop) ABSENT(ulDaqInScanWait) ABSENT(ulDaqInSetTrigger)
ABSENT(ulDaqOGetInfo) ABSENT(ulDaqOGetInfoDbl) ABSENT(ulDaqOutScan) ABSENT(ulDaqOutScanStatus)
ABSENT(ulDaqOutScanStop) ABSENT(ulDaqOutScanWait) ABSENT(ulDaqOutSetTrigger) ABSENT(ulDevGetConfig)
ABSENT(ulDevGetConfigStr) ABSENT(ulDisableEvent) ABSENT(ulEnableEvent) ABSENT(ulFlashLed) ABSENT(ulGetConfig)
ABSENT(ulGetInfoStr) ABSENT(ulMemGetInfo) ABSENT(ulMemRead) ABSENT(ulMemWrite) ABSENT(ulSetConfig) ABSENT(ulTIn)
ABSENT(ulTInArray) ABSENT(ulTmrGetInfo) ABSENT(ulTmrGetInfoDbl) ABSENT(ulTmrPulseOutStart)
ABSENT(ulTmrPulseOutStatus) ABSENT(ulTmrPulseOutStop) ABSENT(ulTmrSetTrigger)

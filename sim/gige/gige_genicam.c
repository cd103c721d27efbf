/* The GenICam file (GenApi 1.1) of a simulated camera: the names of SFNC 2.7 for the registers of gige_registers.h. */
#include "sim/gige/gige_registers.h"

#include "proto/base/memory.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>

/* Grows nowhere: the whole file is measured first, with no room. */
struct writer {
    char *text;
    size_t room, length;
};

static void put(struct writer *w, const char *format, ...) __attribute__((format(printf, 2, 3)));
static void put(struct writer *w, const char *format, ...)
{
    va_list arguments;
    int length;

    va_start(arguments, format);
    length = vsnprintf(w->text ? w->text + w->length : NULL, w->text ? w->room - w->length : 0, format, arguments);
    va_end(arguments);
    if (length > 0)
        w->length += (size_t)length;
}

static void integer_register(struct writer *w, const char *name, const char *port, unsigned address, const char *access)
{
    put(w,
        "<IntReg Name=\"%s\"><Address>0x%x</Address><Length>4</Length><AccessMode>%s</AccessMode><pPort>%s</pPort>"
        "<Cachable>NoCache</Cachable><Sign>Unsigned</Sign><Endianess>BigEndian</Endianess></IntReg>\n",
        name, address, access, port);
}

static void integer(struct writer *w, const char *name, unsigned address, const char *access, long least, long most)
{
    char reg[64];

    snprintf(reg, sizeof reg, "%sRegister", name);
    put(w, "<Integer Name=\"%s\" NameSpace=\"Standard\"><pValue>%s</pValue><Min>%ld</Min><Max>%ld</Max></Integer>\n",
        name, reg, least, most);
    integer_register(w, reg, "Device", address, access);
}

static void real(struct writer *w, const char *name, const char *port, unsigned address, const char *access,
                 const char *unit, double least, double most)
{
    put(w,
        "<Float Name=\"%s\" NameSpace=\"Standard\"><pValue>%sRegister</pValue><Min>%g</Min><Max>%g</Max><Unit>%s</Unit>"
        "</Float>\n",
        name, name, least, most, unit);
    put(w,
        "<FloatReg Name=\"%sRegister\"><Address>0x%x</Address><Length>8</Length><AccessMode>%s</AccessMode>"
        "<pPort>%s</pPort><Cachable>NoCache</Cachable><Endianess>BigEndian</Endianess></FloatReg>\n",
        name, address, access, port);
}

struct entry {
    const char *name;
    unsigned value;
};

static void enumeration(struct writer *w, const char *name, unsigned address, const struct entry *entries)
{
    char reg[64];

    snprintf(reg, sizeof reg, "%sRegister", name);
    put(w, "<Enumeration Name=\"%s\" NameSpace=\"Standard\">\n", name);
    for (; entries->name; entries++)
        put(w, "<EnumEntry Name=\"%s\" NameSpace=\"Standard\"><Value>%u</Value></EnumEntry>\n", entries->name,
            entries->value);
    put(w, "<pValue>%s</pValue></Enumeration>\n", reg);
    integer_register(w, reg, "Device", address, "RW");
}

static void command(struct writer *w, const char *name, const char *reg, unsigned value)
{
    put(w, "<Command Name=\"%s\" NameSpace=\"Standard\"><pValue>%s</pValue><CommandValue>%u</CommandValue></Command>\n",
        name, reg, value);
}

static void boolean(struct writer *w, const char *name, unsigned address)
{
    char reg[64];

    snprintf(reg, sizeof reg, "%sRegister", name);
    put(w,
        "<Boolean Name=\"%s\" NameSpace=\"Standard\"><pValue>%s</pValue><OnValue>1</OnValue><OffValue>0</OffValue>"
        "</Boolean>\n",
        name, reg);
    integer_register(w, reg, "Device", address, "RW");
}

static void string_register(struct writer *w, const char *name, unsigned address, unsigned length)
{
    put(w,
        "<StringReg Name=\"%s\" NameSpace=\"Standard\"><Address>0x%x</Address><Length>%u</Length>"
        "<AccessMode>RO</AccessMode><pPort>Device</pPort></StringReg>\n",
        name, address, length);
}

static void category(struct writer *w, const char *name, const char *const *features)
{
    put(w, "<Category Name=\"%s\" NameSpace=\"Standard\">", name);
    for (; *features; features++)
        put(w, "<pFeature>%s</pFeature>", *features);
    put(w, "</Category>\n");
}

static void categories(struct writer *w)
{
    static const char *const root[] = {"DeviceControl",    "ImageFormatControl",    "AcquisitionControl",
                                       "ChunkDataControl", "TransportLayerControl", NULL};
    static const char *const device[] = {"DeviceVendorName",   "DeviceModelName",   "DeviceVersion",
                                         "DeviceSerialNumber", "DeviceTemperature", NULL};
    static const char *const image[] = {"SensorWidth", "SensorHeight", "Width", "Height", "PixelFormat", NULL};
    static const char *const acquisition[] = {"AcquisitionMode",
                                              "AcquisitionStart",
                                              "AcquisitionStop",
                                              "AcquisitionFrameRate",
                                              "TriggerSelector",
                                              "TriggerMode",
                                              "TriggerSource",
                                              "TriggerActivation",
                                              "TriggerSoftware",
                                              "ExposureTime",
                                              "Gain",
                                              "ActionDeviceKey",
                                              "ActionSelector",
                                              "ActionGroupKey",
                                              "ActionGroupMask",
                                              "CounterSelector",
                                              "CounterEventSource",
                                              NULL};
    static const char *const chunk[] = {"ChunkModeActive", "ChunkSelector", "ChunkEnable", NULL};
    static const char *const transport[] = {"PayloadSize", "GevSCPSPacketSize", "GevSCPSFireTestPacket", NULL};

    category(w, "Root", root);
    category(w, "DeviceControl", device);
    category(w, "ImageFormatControl", image);
    category(w, "AcquisitionControl", acquisition);
    category(w, "ChunkDataControl", chunk);
    category(w, "TransportLayerControl", transport);
}

static void features(struct writer *w, const struct gige_identity *identity)
{
    static const struct entry formats[] = {{"BayerRG8", GIGE_RG8},
                                           {"BayerRG10", GIGE_RG10},
                                           {"BayerRG12", GIGE_RG12},
                                           {"BayerRG16", GIGE_RG16},
                                           {"BayerRG10p", GIGE_RG10P},
                                           {"BayerRG12p", GIGE_RG12P},
                                           {"BayerRG12Packed", GIGE_RG12_PACKED},
                                           {"Mono8", GIGE_MONO8},
                                           {"RGB8", GIGE_RGB8},
                                           {"JPEG", GIGE_JPEG},
                                           {NULL, 0}};
    static const struct entry modes[] = {{"Continuous", 0}, {NULL, 0}};
    static const struct entry selectors[] = {{"FrameStart", 0}, {NULL, 0}};
    static const struct entry on_off[] = {{"Off", 0}, {"On", 1}, {NULL, 0}};
    static const struct entry sources[] = {
        {"Software", GIGE_SOURCE_SOFTWARE}, {"Line1", GIGE_SOURCE_LINE1}, {"Action1", GIGE_SOURCE_ACTION1}, {NULL, 0}};
    static const struct entry edges[] = {{"RisingEdge", 0}, {"FallingEdge", 1}, {NULL, 0}};

    string_register(w, "DeviceVendorName", 0x48, 32);
    string_register(w, "DeviceModelName", 0x68, 32);
    string_register(w, "DeviceVersion", 0x88, 32);
    string_register(w, "DeviceFirmwareVersion", 0x88, 32);
    string_register(w, "DeviceSerialNumber", 0xd8, 16);
    real(w, "DeviceTemperature", "Device", GIGE_TEMPERATURE, "RO", "C", -40, 120);
    integer(w, "SensorWidth", GIGE_SENSOR_WIDTH, "RO", 1, identity->width);
    integer(w, "SensorHeight", GIGE_SENSOR_HEIGHT, "RO", 1, identity->height);
    integer(w, "Width", GIGE_WIDTH, "RW", 1, identity->width);
    integer(w, "Height", GIGE_HEIGHT, "RW", 1, identity->height);
    enumeration(w, "PixelFormat", GIGE_PIXEL_FORMAT, formats);
    integer(w, "PayloadSize", GIGE_PAYLOAD, "RO", 0, 0x7fffffff);
    enumeration(w, "AcquisitionMode", GIGE_ACQUISITION_MODE, modes);
    integer_register(w, "AcquisitionRegister", "Device", GIGE_ACQUISITION, "RW");
    command(w, "AcquisitionStart", "AcquisitionRegister", 1);
    command(w, "AcquisitionStop", "AcquisitionRegister", 0);
    real(w, "AcquisitionFrameRate", "Device", GIGE_FRAME_RATE, "RW", "Hz", 0.1, 200);
    enumeration(w, "TriggerSelector", GIGE_TRIGGER_SELECTOR, selectors);
    enumeration(w, "TriggerMode", GIGE_TRIGGER_MODE, on_off);
    enumeration(w, "TriggerSource", GIGE_TRIGGER_SOURCE, sources);
    enumeration(w, "TriggerActivation", GIGE_TRIGGER_ACTIVATION, edges);
    integer_register(w, "TriggerSoftwareRegister", "Device", GIGE_TRIGGER_SOFTWARE, "WO");
    command(w, "TriggerSoftware", "TriggerSoftwareRegister", 1);
    real(w, "ExposureTime", "Device", GIGE_EXPOSURE_TIME, "RW", "us", 10, 10e6);
    real(w, "Gain", "Device", GIGE_GAIN, "RW", "dB", 0, 24);
    integer(w, "ActionDeviceKey", GIGE_ACTION_DEVICE_KEY, "RW", 0, 0xffffffffL);
    integer(w, "ActionSelector", GIGE_ACTION_SELECTOR, "RW", 1, 1);
    integer(w, "ActionGroupKey", GIGE_ACTION_GROUP_KEY, "RW", 0, 0xffffffffL);
    integer(w, "ActionGroupMask", GIGE_ACTION_GROUP_MASK, "RW", 0, 0xffffffffL);
}

static void chunk_port(struct writer *w, const char *port, unsigned chunk)
{
    put(w, "<Port Name=\"%s\"><ChunkID>%x</ChunkID></Port>\n", port, GIGE_CHUNK_ID(chunk));
}

static void chunk_integer(struct writer *w, const char *name, const char *port, int length)
{
    put(w,
        "<IntReg Name=\"%s\" NameSpace=\"Standard\"><Address>0</Address><Length>%d</Length><AccessMode>RO</AccessMode>"
        "<pPort>%s</pPort><Cachable>NoCache</Cachable><Sign>Unsigned</Sign><Endianess>BigEndian</Endianess></IntReg>\n",
        name, length, port);
}

static void chunks(struct writer *w)
{
    static const struct entry selectors[] = {{"Image", GIGE_CHUNK_IMAGE},
                                             {"ExposureTime", GIGE_CHUNK_EXPOSURE},
                                             {"Gain", GIGE_CHUNK_GAIN},
                                             {"Timestamp", GIGE_CHUNK_TIMESTAMP},
                                             {"FrameID", GIGE_CHUNK_FRAME_ID},
                                             {"CounterValue", GIGE_CHUNK_COUNTER},
                                             {NULL, 0}};
    static const struct entry counters[] = {{"Counter0", 0}, {NULL, 0}};
    static const struct entry events[] = {{"Off", 0}, {"FrameTrigger", 1}, {NULL, 0}};

    boolean(w, "ChunkModeActive", GIGE_CHUNK_MODE);
    enumeration(w, "ChunkSelector", GIGE_CHUNK_SELECTOR, selectors);
    boolean(w, "ChunkEnable", GIGE_CHUNK_ENABLE);
    enumeration(w, "CounterSelector", GIGE_ACQUISITION_MODE, counters); /* there is one: any register that holds 0 */
    enumeration(w, "CounterEventSource", GIGE_COUNTER_SOURCE, events);
    chunk_port(w, "ExposurePort", GIGE_CHUNK_EXPOSURE);
    chunk_port(w, "GainPort", GIGE_CHUNK_GAIN);
    chunk_port(w, "TimestampPort", GIGE_CHUNK_TIMESTAMP);
    chunk_port(w, "FramePort", GIGE_CHUNK_FRAME_ID);
    chunk_port(w, "CounterPort", GIGE_CHUNK_COUNTER);
    real(w, "ChunkExposureTime", "ExposurePort", 0, "RO", "us", 0, 1e9);
    real(w, "ChunkGain", "GainPort", 0, "RO", "dB", -100, 100);
    chunk_integer(w, "ChunkTimestamp", "TimestampPort", 8);
    chunk_integer(w, "ChunkFrameID", "FramePort", 8);
    chunk_integer(w, "ChunkCounterValue", "CounterPort", 8);
}

static void transport(struct writer *w)
{
    put(w,
        "<Integer Name=\"GevSCPSPacketSize\" NameSpace=\"Standard\"><pValue>PacketSizeRegister</pValue><Min>220</Min>"
        "<Max>16384</Max><Inc>4</Inc></Integer>\n");
    put(w,
        "<MaskedIntReg Name=\"PacketSizeRegister\"><Address>0x%x</Address><Length>4</Length><AccessMode>RW</AccessMode>"
        "<pPort>Device</pPort><Cachable>NoCache</Cachable><LSB>31</LSB><MSB>16</MSB><Sign>Unsigned</Sign>"
        "<Endianess>BigEndian</Endianess></MaskedIntReg>\n",
        GIGE_PACKET_SIZE);
    put(w,
        "<MaskedIntReg Name=\"FireTestRegister\"><Address>0x%x</Address><Length>4</Length><AccessMode>RW</AccessMode>"
        "<pPort>Device</pPort><Cachable>NoCache</Cachable><Bit>0</Bit><Endianess>BigEndian</Endianess></"
        "MaskedIntReg>\n",
        GIGE_PACKET_SIZE);
    command(w, "GevSCPSFireTestPacket", "FireTestRegister", 1);
}

static void document(struct writer *w, const struct gige_identity *identity)
{
    put(w,
        "<?xml version=\"1.0\" encoding=\"utf-8\"?>\n"
        "<RegisterDescription ModelName=\"%s\" VendorName=\"%s\" StandardNameSpace=\"None\" SchemaMajorVersion=\"1\" "
        "SchemaMinorVersion=\"1\" SchemaSubMinorVersion=\"0\" MajorVersion=\"1\" MinorVersion=\"0\" "
        "SubMinorVersion=\"0\" ToolTip=\"simulated camera\" ProductGuid=\"0\" VersionGuid=\"0\" "
        "xmlns=\"http://www.genicam.org/GenApi/Version_1_1\">\n",
        identity->model, identity->vendor);
    categories(w);
    features(w, identity);
    chunks(w);
    transport(w);
    put(w, "<Port Name=\"Device\" NameSpace=\"Standard\"/>\n</RegisterDescription>\n");
}

char *gige_genicam(const struct gige_identity *identity)
{
    struct writer w = {0};

    document(&w, identity);
    w.room = w.length + 1;
    w.text = lumi_alloc(w.room, 1);
    w.length = 0;
    if (w.text)
        document(&w, identity);
    return w.text;
}

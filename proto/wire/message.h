/* Messages to bytes and back (nanopb, rig.proto), and the rig profile and the plan as messages. Freestanding. */
#ifndef LUMI_PROTO_WIRE_MESSAGE_H
#define LUMI_PROTO_WIRE_MESSAGE_H

#include "proto/base/result.h"
#include "proto/mechanism/sweep_plan.h"

#include <rig.pb.h>

#ifdef __cplusplus
extern "C" {
#endif

#define LUMI_WIRE_VERSION_MIN 1
#define LUMI_WIRE_VERSION_MAX 1

/* Into at most LUMI_WIRE_PAYLOAD_MAX bytes; returns the length, or 0 for a message that cannot be encoded. */
size_t lumi_wire_encode_host(const lumi_wire_HostFrame *frame, uint8_t *data, size_t size);
size_t lumi_wire_encode_board(const lumi_wire_BoardFrame *frame, uint8_t *data, size_t size);
/* False: malformed. Trusts nothing; strings end, counts fit, enums may be unknown. */
bool lumi_wire_decode_host(const uint8_t *data, size_t size, lumi_wire_HostFrame *frame);
bool lumi_wire_decode_board(const uint8_t *data, size_t size, lumi_wire_BoardFrame *frame);

/* The whole profile as bytes (at most LUMI_WIRE_PROFILE_MAX) and back, number for number. Decoding does not check the
 * rig: lumi_rig_check does. LUMI_ERR_FORMAT, LUMI_ERR_VERSION. The scratch message is the caller's: it is too big for a
 * small stack. */
#define LUMI_WIRE_PROFILE_MAX lumi_wire_Profile_size
size_t lumi_wire_encode_profile(const struct lumi_rig *rig, lumi_wire_Profile *scratch, uint8_t *data, size_t size);
int lumi_wire_decode_profile(const uint8_t *data, size_t size, lumi_wire_Profile *scratch, struct lumi_rig *rig,
                             struct lumi_error *error);
void lumi_wire_from_plan(const struct lumi_plan *plan, lumi_wire_Plan *message);
int lumi_wire_to_plan(const lumi_wire_Plan *message, struct lumi_plan *plan, struct lumi_error *error);
/* CRC-32C of the encoded plan: what StartSweep names. */
uint32_t lumi_wire_plan_crc(const struct lumi_plan *plan);

#ifdef __cplusplus
}
#endif
#endif

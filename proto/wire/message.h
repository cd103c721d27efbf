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

/* Into at most `size` bytes; returns the length, or 0 for a message that cannot be encoded. */
size_t lumi_wire_encode_host(const lumi_wire_HostFrame *frame, uint8_t *data, size_t size);
size_t lumi_wire_encode_board(const lumi_wire_BoardFrame *frame, uint8_t *data, size_t size);
size_t lumi_wire_encode_event(const lumi_wire_Event *event, uint8_t *data, size_t size);
/* False: malformed. Trusts nothing: counts fit; texts end and are printable (lumi_wire_clean_text). What stays
 * possible: enums of unknown value, numbers that are not finite, a body or command of a later version (its tag is then
 * 0). */
bool lumi_wire_decode_host(const uint8_t *data, size_t size, lumi_wire_HostFrame *frame);
bool lumi_wire_decode_board(const uint8_t *data, size_t size, lumi_wire_BoardFrame *frame);
/* Token and number of a request that as a whole is malformed (a text or a list longer than ours), so that it can be
 * answered. False if it is none, or not even that can be read. */
bool lumi_wire_decode_request_head(const uint8_t *data, size_t size, uint32_t *token, uint32_t *number);

/* Makes one line of well-formed UTF-8 of it, in place: '?' for every other byte and every control character. Ends it at
 * size − 1, or before if that would cut a character. */
void lumi_wire_clean_text(char *text, size_t size);
/* Copies a text into a message's field of `size` bytes, cut where it must be. */
void lumi_wire_copy_text(char *field, size_t size, const char *text);

/* All texts of an event. */
void lumi_wire_clean_event(lumi_wire_Event *event);

/* "done", "refused" …; NULL for a value that has none. */
const char *lumi_wire_result_name(lumi_wire_Result result);
const char *lumi_wire_state_name(lumi_wire_State state);

/* The whole profile as bytes (at most LUMI_WIRE_PROFILE_MAX) and back, number for number. Decoding does not check the
 * rig: lumi_rig_check does, and a count or choice that the struct cannot hold is LUMI_ERR_FORMAT, a newer version of
 * the message LUMI_ERR_VERSION. Encoding returns 0 for what cannot be encoded (a count out of range). The scratch
 * message is the caller's: it is too big for a small stack. */
#define LUMI_WIRE_PROFILE_MAX lumi_wire_Profile_size
#define LUMI_WIRE_PROFILE_VERSION 1
size_t lumi_wire_encode_profile(const struct lumi_rig *rig, lumi_wire_Profile *scratch, uint8_t *data, size_t size);
int lumi_wire_decode_profile(const uint8_t *data, size_t size, lumi_wire_Profile *scratch, struct lumi_rig *rig,
                             struct lumi_error *error);
/* The same for a plan. */
void lumi_wire_from_plan(const struct lumi_plan *plan, lumi_wire_Plan *message);
int lumi_wire_to_plan(const lumi_wire_Plan *message, struct lumi_plan *plan, struct lumi_error *error);
/* CRC-32C of the encoded plan: what StartSweep names. */
uint32_t lumi_wire_plan_crc(const struct lumi_plan *plan);

/* For hosts. The requests that write an encoded profile to the board, in order: part after part, then the commit. `at`
 * is 0 before the first and moves on; false: there is no further one. */
bool lumi_wire_profile_request(const uint8_t *data, size_t size, size_t *at, lumi_wire_Request *request);
/* LUMI_OK for DONE; otherwise LUMI_ERR_BUSY (refused), _FORMAT (bad), _UNSUPPORTED or _IO, with what the board says. */
int lumi_wire_reply_result(const lumi_wire_Reply *reply, struct lumi_error *error);

#ifdef __cplusplus
}
#endif
#endif

/* The messages of the worked example in docs/rig-wire.md. */
#ifndef LUMI_TESTS_UNIT_WIRE_EXAMPLES_H
#define LUMI_TESTS_UNIT_WIRE_EXAMPLES_H

#include "proto/wire/message.h"

#define EXAMPLE_TOKEN 0x0a0b0c0d

static const lumi_wire_HostFrame example_hello = {
    .which_body = lumi_wire_HostFrame_hello_tag,
    .body.hello = {.version_min = 1, .version_max = 1, .host = 0x1122334455667788, .nonce = 1}};
static const lumi_wire_BoardFrame example_welcome = {.which_body = lumi_wire_BoardFrame_welcome_tag,
                                                     .body.welcome = {.version = 1,
                                                                      .host = 0x1122334455667788,
                                                                      .token = EXAMPLE_TOKEN,
                                                                      .boot = 0xb007,
                                                                      .board = "stm32f405",
                                                                      .unique_id = {.size = 3, .bytes = {1, 0, 2}},
                                                                      .firmware = "0.1.0",
                                                                      .version_min = 1,
                                                                      .version_max = 1,
                                                                      .nonce = 1}};
static const lumi_wire_HostFrame example_request = {
    .which_body = lumi_wire_HostFrame_request_tag,
    .body.request = {
        .token = EXAMPLE_TOKEN, .number = 1, .which_command = lumi_wire_Request_jog_tag, .command.jog.turns = 0.25}};
static const lumi_wire_BoardFrame example_reply = {.which_body = lumi_wire_BoardFrame_reply_tag,
                                                   .body.reply = {.token = EXAMPLE_TOKEN, .number = 1}};
static const lumi_wire_HostFrame example_heartbeat = {
    .which_body = lumi_wire_HostFrame_heartbeat_tag,
    .body.heartbeat = {.token = EXAMPLE_TOKEN, .host_time = 1000000000, .events_next = 3}};
static const lumi_wire_BoardFrame example_event = {
    .which_body = lumi_wire_BoardFrame_event_tag,
    .body.event = {.number = 3,
                   .time_ns = 2000000000,
                   .which_kind = lumi_wire_Event_state_changed_tag,
                   .kind.state_changed = {.from = lumi_wire_State_IDLE, .to = lumi_wire_State_JOGGING},
                   .boot = 0xb007,
                   .oldest = 3}};

#endif

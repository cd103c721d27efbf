/* Answers: JSON, and problem documents. */
#include "daemon/http/api_priv.h"

#include <string.h>

/* libsoup has no words for what is newer than RFC 7231. */
static const char *phrase(unsigned status)
{
    return status == 421 ? "Misdirected Request" : soup_status_get_phrase(status);
}

void lumi_api_answer(struct lumi_api_answer *answer, unsigned status, const char *type, char *text)
{
    g_free(answer->text);
    *answer = (struct lumi_api_answer){.status = status, .type = type, .text = text};
}

void lumi_api_answer_json(struct lumi_api_answer *answer, unsigned status, JsonBuilder *builder)
{
    lumi_api_answer(answer, status, "application/json", lumi_api_finish(builder));
}

void lumi_api_send(SoupServerMessage *message, struct lumi_api_answer *answer)
{
    SoupMessageHeaders *headers = soup_server_message_get_response_headers(message);

    soup_message_headers_replace(headers, "Cache-Control", "no-store");
    soup_message_headers_replace(headers, "X-Content-Type-Options", "nosniff");
    soup_server_message_set_status(message, answer->status, phrase(answer->status));
    soup_server_message_set_response(message, answer->type, SOUP_MEMORY_TAKE, answer->text, strlen(answer->text));
    *answer = (struct lumi_api_answer){0};
}

void lumi_api_send_problem(SoupServerMessage *message, unsigned status, const char *word, const char *detail)
{
    struct lumi_api_answer answer = {0};

    lumi_api_problem(&answer, status, word, detail);
    lumi_api_send(message, &answer);
}

static char *problem_text(unsigned status, const char *word, const char *detail)
{
    g_autoptr(JsonBuilder) builder = json_builder_new();
    g_autofree char *type = g_strconcat("urn:lumid:", word, NULL);

    json_builder_begin_object(builder);
    lumi_api_put_text(builder, "type", type);
    lumi_api_put_text(builder, "title", phrase(status));
    lumi_api_put_int(builder, "status", status);
    lumi_api_put_text(builder, "detail", detail);
    json_builder_end_object(builder);
    return lumi_api_finish(builder);
}

char *lumi_api_problem_message(unsigned status, const char *word, const char *detail)
{
    g_autofree char *document = problem_text(status, word, detail);

    return g_strdup_printf("HTTP/1.1 %u %s\r\nContent-Type: application/problem+json\r\nContent-Length: "
                           "%zu\r\nCache-Control: no-store\r\nConnection: close\r\n\r\n%s",
                           status, phrase(status), strlen(document), document);
}

void lumi_api_problem(struct lumi_api_answer *answer, unsigned status, const char *word, const char *detail)
{
    lumi_api_answer(answer, status, "application/problem+json", problem_text(status, word, detail));
}

void lumi_api_problem_of(struct lumi_api_answer *answer, int code, const char *text)
{
    static const struct {
        int code;
        unsigned status;
        const char *word;
    } table[] = {
        {LUMI_ERR_NOMEM, 503, "nomem"},
        {LUMI_ERR_IO, 500, "io"},
        {LUMI_ERR_NOSPACE, 507, "nospace"},
        {LUMI_ERR_BUSY, 409, "busy"},
        {LUMI_ERR_CANCELLED, 409, "cancelled"},
        {LUMI_ERR_ARG, 400, "argument"},
        {LUMI_ERR_FORMAT, 422, "format"},
        {LUMI_ERR_VERSION, 422, "version"},
        {LUMI_ERR_UNSUPPORTED, 422, "unsupported"},
        {LUMI_ERR_CHECKSUM, 422, "checksum"},
        {LUMI_ERR_NOTFOUND, 404, "notfound"},
        {LUMI_ERR_EXISTS, 409, "exists"},
        {LUMI_ERR_LIMIT, 422, "limit"},
    };

    for (size_t i = 0; i < sizeof table / sizeof table[0]; i++)
        if (table[i].code == code) {
            lumi_api_problem(answer, table[i].status, table[i].word, text);
            return;
        }
    lumi_api_problem(answer, 500, "internal", text);
}

/* Names of files that are being made, on a disk that several computers may share.
 *
 * "<path>.tmp-<place>-<process><extension>": the place is a computer and one of its ranges of process numbers (a
 * container has its own). */
#ifndef LUMI_PIPELINE_RUN_TEMPORARY_H
#define LUMI_PIPELINE_RUN_TEMPORARY_H

/* For an output of this process at `path`; one at a time. Free with g_free. */
char *lumi_run_temporary(const char *path, const char *extension);

/* Removes what killed processes left in the folders below `work`: those of this place that are no more; those of
 * another one when nobody has written to them for a day before the lock file `lock` was written to (which this does;
 * the file server's clock counts). */
void lumi_run_remove_leftovers(const char *work, int lock);

#endif

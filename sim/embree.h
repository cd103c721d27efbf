/* Embree 3 (Debian 12) or 4 (Debian 13) behind two functions; the rest of its API is the same in both. */
#ifndef LUMI_SIM_EMBREE_H
#define LUMI_SIM_EMBREE_H

#if SIM_EMBREE == 4
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif

/* The nearest hit of one ray. */
static inline void sim_embree_intersect(RTCScene scene, struct RTCRayHit *hit)
{
#if SIM_EMBREE == 4
    rtcIntersect1(scene, hit, NULL);
#else
    struct RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    rtcIntersect1(scene, &context, hit);
#endif
}

/* Sets ray->tfar to −∞ if anything is hit between tnear and tfar. */
static inline void sim_embree_occluded(RTCScene scene, struct RTCRay *ray)
{
#if SIM_EMBREE == 4
    rtcOccluded1(scene, ray, NULL);
#else
    struct RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    rtcOccluded1(scene, &context, ray);
#endif
}

#endif

// What is asked of a ray, and the answer; `ray` is the one in hand.

// What a ray met first.
const INFINITY: u32 = 0u;
const OBJECT: u32 = 1u;
const REAL: u32 = 2u;

struct First {
    what: u32,
    object: Hit,
    real: RealHit,
    // Of the ray.
    direction: vec3f,
}

// A ray and what is asked of it.
struct Quest {
    origin: vec3f,
    limit: f32,
    direction: vec3f,
    // ASKS and bits of the ones below; 0 for no question.
    asks: u32,
    // Of a light sample; of a camera ray the number that picks one of the texels it shows, and whether changes are looked for.
    goal: vec3f,
    aimed: u32,
}

// Objects may lie on it; any of them will do.
const FOR_OBJECTS: u32 = 2u;
const FOR_ANY: u32 = 4u;
// The real world is asked if an object was met, if none was, and for what lies behind objects, too.
const IF_MET: u32 = 8u;
const UNLESS_MET: u32 = 16u;
const BEHIND_OBJECTS: u32 = 32u;
// It is the camera's: the picture may show another surface than lies there.
const AS_SHOWN: u32 = 64u;
// What it meets is to show what objects have changed of it; what it mirrors goes by the normal just there, as light samples do.
const AS_UPDATED: u32 = 512u;
const BY_FACET: u32 = 1024u;
// A real surface is to be found, its radiance need not be.
const UNLIT: u32 = 2048u;
// It comes from an object, to which real surfaces show other mirror images than the panorama has seen.
const FROM_OBJECT: u32 = 4096u;

var<private> ray: Quest;

// A ray without end of which nothing is asked yet.
fn quest_of(origin: vec3f, direction: vec3f) -> Quest {
    return Quest(origin, NEVER, direction, 0u, vec3f(0.0), AT_ANYTHING);
}

// Whether the real world is asked.
fn asks_world(asks: u32, met: bool) -> bool {
    return asks != 0u && (asks & select(IF_MET, UNLESS_MET, met)) == 0u;
}

struct Answer {
    object: Hit,
    real: RealHit,
    // The light that arrives from the real world, and the density with which a light sample finds it. `known`: the world can tell it,
    // and it is what the light sample was aimed at.
    light: vec3f,
    pdf: f32,
    known: bool,
    // The real world was asked.
    asked: bool,
}

// What the ray in hand met first.
fn first_of(answer: Answer) -> First {
    let met = answer.object.instance != NOTHING;
    var first = First(INFINITY, answer.object, answer.real, ray.direction);
    if answer.real.exists && (!met || answer.real.t < answer.object.t) {
        first.what = REAL;
    } else if met {
        first.what = OBJECT;
    }
    return first;
}

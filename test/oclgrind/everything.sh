# everything.sh FOLDER [PART...] -- FOLDER/everything.xml: a scene of a few pixels that calls for every part of the
# kernels, but for those named: media, scattering, multiple-scattering, emission, chromatic, anisotropy, null, quadrics,
# specular, textures, delta-lights, many-lights, area-lights, environment. Its pictures are FOLDER/a.exr and a.png.
folder=$1
shift
left_out=" $* "
has() { case $left_out in *" $1 "*) return 1 ;; esac; }
choose() { if has "$1"; then echo "$2"; else echo "$3"; fi; }

fog=$(choose media '<ref id="fog"/>' '')
around=$(choose media '<ref name="exterior" id="fog"/>' '')
within=$(choose media '<ref name="interior" id="glow"/><ref name="exterior" id="fog"/>' '')
checks=$(choose textures '<texture type="checkerboard" name="reflectance"/>' '')
file='<string name="filename" value="a.png"/>'
picture=$(choose textures "<texture type=\"bitmap\" name=\"reflectance\">$file</texture>" '')
gobo=$(choose textures "<texture type=\"bitmap\" name=\"texture\">$file</texture>" '')
surface() { choose specular "<bsdf type=\"$1\"/>" '<bsdf type="diffuse"/>'; }
{
    cat <<X
<scene version="3.0.0">
<integrator type="volpath">
<integer name="max_depth" value="$(choose multiple-scattering 4 2)"/></integrator>
X
    has media && cat <<X
<medium type="homogeneous" id="fog"><rgb name="sigma_t" value="$(choose chromatic '0.1, 0.12, 0.15' 0.1)"/>
<rgb name="albedo" value="$(choose scattering 0.75 0)"/>
<phase type="hg"><float name="g" value="$(choose anisotropy 0.4 0)"/></phase></medium>
<medium type="homogeneous" id="glow"><float name="sigma_t" value="0.5"/>
<rgb name="albedo" value="$(choose scattering 0.75 0)"/>
<rgb name="emission" value="$(choose emission '0.1, 0.2, 0.1' 0)"/></medium>
X
    cat <<X
<sensor type="thinlens"><float name="aperture_radius" value="0.05"/><float name="focus_distance" value="5"/>
<float name="fov" value="60"/>
<transform name="to_world"><lookat origin="0,0.5,-5" target="0,0,0" up="0,1,0"/></transform>
$fog<film type="hdrfilm"><integer name="width" value="6"/><integer name="height" value="4"/></film></sensor>
<shape type="rectangle">
<transform name="to_world"><scale value="8"/><rotate x="1" angle="-90"/><translate y="-1"/></transform>
<bsdf type="diffuse">$checks</bsdf></shape>
<shape type="rectangle">
<transform name="to_world"><scale value="3"/><rotate y="1" angle="180"/><translate z="3"/></transform>
<bsdf type="twosided"><bsdf type="diffuse">$picture</bsdf></bsdf></shape>
<shape type="cube"><transform name="to_world"><scale value="0.4"/><translate x="-1.5"/></transform>
$(surface roughconductor)</shape>
<shape type="cube"><transform name="to_world"><scale value="0.4"/><translate x="1.2" y="-0.5"/></transform>
$(surface dielectric)$around</shape>
X
    has quadrics && cat <<X
<shape type="sphere"><float name="radius" value="0.6"/>$(surface dielectric)$around</shape>
<shape type="disk"><transform name="to_world"><rotate y="1" angle="160"/><translate x="1.5"/></transform>
$(surface conductor)</shape>
X
    has null && cat <<X
<shape type="cube"><transform name="to_world"><scale value="0.5"/><translate x="-0.5" y="1"/></transform>
<bsdf type="null"/>$within</shape>
X
    has area-lights && cat <<X
<shape type="rectangle"><transform name="to_world"><rotate x="1" angle="90"/><translate y="3"/></transform>
<emitter type="area"><rgb name="radiance" value="2"/></emitter></shape>
X
    has area-lights && has quadrics && cat <<X
<shape type="sphere"><point name="center" x="2" y="2" z="0"/><float name="radius" value="0.2"/>
<emitter type="area"><rgb name="radiance" value="5"/></emitter></shape>
X
    has environment && echo '<emitter type="envmap"><string name="filename" value="a.exr"/></emitter>'
    has delta-lights && cat <<X
<emitter type="directional"><vector name="direction" x="0.2" y="-1" z="0.1"/></emitter>
<emitter type="spot"><transform name="to_world"><lookat origin="0,3,-1" target="0,0,0" up="0,0,1"/></transform>
$gobo</emitter>
X
    i=0
    while has delta-lights && [ $i -lt "$(choose many-lights 130 2)" ]; do
        echo "<emitter type=\"point\">"
        echo "<point name=\"position\" x=\"$((i % 13 - 6))\" y=\"2\" z=\"$((i / 13 - 5))\"/></emitter>"
        i=$((i + 1))
    done
    echo '</scene>'
} >"$folder/everything.xml"
